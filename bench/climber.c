/* The controller's law and the unicycle climber once more, in C: the limit for `bench/tick.py` and
 * `bench/batch.py`, which refuse to run if it gives something else. Guidance, observer and limits
 * as in climber_uk/control, the step as in closed_loop/unicycle.py, sums as in closed_loop/outcome.py.
 * Many climbers lie side by side in rows, and no loop over them has a branch: with -O3 -ffast-math
 * the compiler does eight at once, libmvec's tanh and atan included. */
#include <math.h>

typedef struct { double x, y, heading, cosine, sine, speed, yaw_rate; } Motion;
typedef struct { double drive, turn; } Wrench;
typedef struct { double x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y; } Target;
typedef struct { double mass, inertia, radius, half_track, friction, weight, limit; } Climber;
typedef struct { double omega, damping, omega_n, k_y, v_s, share, v_c, radius, turn_rate; } Gains;
typedef struct { Climber climber; Gains gains; double friction_speed, bandwidth; } Law;
typedef struct { double force, turn, force_1, turn_1, friction, stiction; } Learnt;
typedef struct { Motion motion; Wrench held; Learnt learnt; double learning, direction; } Memory;
typedef struct {
  double x, y, heading, c, s, v, v_1, omega, omega_1;
  double wait, hurry, turn, g, g_1, g_2;
} Track;

#define SLOW 0.01
#define INLINE static inline __attribute__((always_inline))

INLINE double sign(double x) { return (x > 0) - (x < 0); }
INLINE double clip(double x, double low, double high) { return fmin(fmax(x, low), high); }

/* Good to 1e-16 for less than MOST; who turns faster is not for this code. */
#define MOST 0.1
INLINE void rotate(double c, double s, double angle, double *cosine, double *sine) {
  double q = angle * angle;
  double dc = 1 - q * (1.0 / 2 - q * (1.0 / 24 - q * (1.0 / 720 - q * (1.0 / 40320))));
  double ds = angle * (1 - q * (1.0 / 6 - q * (1.0 / 120 - q * (1.0 / 5040))));
  *cosine = dc * c - ds * s;
  *sine = ds * c + dc * s;
}

INLINE Motion predicted(const Climber *p, Motion m, Wrench w, double time, double friction) {
  double half = time / 2, omega_1 = w.turn / p->inertia, c, s, most = p->friction + friction;
  rotate(m.cosine, m.sine, half * (m.yaw_rate + half / 2 * omega_1), &c, &s);
  double push = w.drive - p->weight * s, held = clip(push, -most, most);
  double rub = m.speed != 0 ? copysign(most, m.speed) : held;
  double v_1 = (push - rub) / p->mass, way = time * (m.speed + half * v_1);
  double v = m.speed + time * v_1, stops = m.speed * v < 0;
  double left = time + m.speed / (stops ? v_1 : 1), back_1 = (push - held) / p->mass;
  way = stops ? 0.5 * (m.speed * (time - left) + left * left * back_1) : way;
  v = stops ? left * back_1 : v;
  double angle = time * (m.yaw_rate + half * omega_1);
  Motion end = {m.x + way * c, m.y + way * s, m.heading + angle, 0, 0, v,
                m.yaw_rate + time * omega_1};
  rotate(m.cosine, m.sine, angle, &end.cosine, &end.sine);
  return end;
}

static Track track(const Gains *k, const Target *t) {
  double c = cos(t->heading), s = sin(t->heading);
  double v = t->v_x * c + t->v_y * s, v_1 = t->a_x * c + t->a_y * s;
  double v_2 = t->j_x * c + t->j_y * s + t->omega * t->omega * v;
  double fade = k->v_s * k->v_s, fast = pow(k->k_y * v / k->omega_n, 2);
  double square = v * v * (1 + fast) + fade, falls = fade - fast * v * v;
  double steep = 1 / (square * sqrt(square)), g_1 = falls * steep * v_1;
  double bend = -v * steep * (4 * fast + 3 * falls * (1 + 2 * fast) / square);
  double wait = sqrt(v * v + fade / 4), more = k->share * fabs(v);
  int below = more < k->v_c;
  double hurry = sqrt(fade / 4 + (below ? more * more : k->v_c * k->v_c));
  double turn = sqrt(v * v + fade) / k->radius;
  Track found = {t->x, t->y, t->heading, c, s, v, v_1, t->omega, t->omega_1,
                 wait, hurry, fmin(turn, k->turn_rate),
                 k->k_y * v / sqrt(square), k->k_y * g_1,
                 k->k_y * (falls * steep * v_2 + bend * v_1 * v_1)};
  return found;
}

INLINE void demand(const Gains *k, const Track *t, Motion m, double *v_1, double *turning,
                          double *wanted) {
  double dx = m.x - t->x, dy = m.y - t->y, turned = m.heading - t->heading;
  turned -= 2 * M_PI * floor(turned / (2 * M_PI) + 0.5);
  double e_x = dx * t->c + dy * t->s, e_y = dy * t->c - dx * t->s;
  double v_x = m.speed * (m.cosine * t->c + m.sine * t->s);
  double sine_e = m.sine * t->c - m.cosine * t->s, omega = m.yaw_rate - t->omega;
  double e_x1 = v_x - t->v + t->omega * e_y, e_y1 = m.speed * sine_e - t->omega * e_x;
  double most = e_x * t->v > 0 ? t->wait : t->hurry;
  double v = t->v - most * tanh(k->omega / k->damping * e_x / most);
  *v_1 = t->v_1 - k->damping * k->omega * (m.speed - v);
  double e_y2 = *v_1 * sine_e + v_x * omega - t->omega_1 * e_x - t->omega * e_x1;
  double w = t->g * e_y, w_1 = t->g_1 * e_y + t->g * e_y1;
  double w_2 = t->g_2 * e_y + 2 * t->g_1 * e_y1 + t->g * e_y2;
  double slope = 1 / (1 + w * w), steered = slope * w_1, led = turned + atan(w);
  double led_1 = omega + steered, led_2 = slope * w_2 - 2 * w * steered * steered;
  double rate = led_1 + t->turn * tanh(k->omega_n / k->damping * led / t->turn);
  *turning = t->omega_1 - led_2 - k->damping * k->omega_n * rate;
  *wanted = v;
}

INLINE Wrench limited(const Climber *p, Wrench w) {
  double to_mean = p->radius / 2, to_twist = to_mean / p->half_track, most = p->limit;
  double mean = to_mean * w.drive, twist = to_twist * w.turn;
  int fits = (fabs(mean + twist) <= most) & (fabs(mean - twist) <= most);
  double cut = clip(twist, -most, most), left = most - fabs(cut);
  Wrench got = {fits ? w.drive : clip(mean, -left, left) / to_mean,
                fits ? w.turn : cut / to_twist};
  return got;
}

INLINE Learnt corrected(const Law *k, const Memory *m, Motion found, double period) {
  const Climber *p = &k->climber;
  Learnt old = m->learnt, r = old;
  Wrench acting = {m->held.drive + old.force, m->held.turn + old.turn};
  Motion expected = predicted(p, m->motion, acting, period, old.friction);
  double fresh = 1 - exp(-fmin(k->bandwidth * period, 0.2)), newer = fresh * fresh / period;
  double v_1 = p->mass * (found.speed - expected.speed) / period;
  double omega_1 = p->inertia * (found.yaw_rate - expected.yaw_rate) / period;
  double change = period * old.force_1 + 2 * fresh * v_1, direction = m->direction;
  double rubs = clip(old.friction - 0.5 * direction * change, -p->friction, p->friction);
  r.friction = direction * expected.speed > -SLOW ? rubs : old.friction;
  r.force += change + direction * (r.friction - old.friction);
  r.turn += period * old.turn_1 + 2 * fresh * omega_1;
  r.force_1 = fabs(expected.speed) > 1e-3 ? old.force_1 + newer * v_1 : 0;
  r.turn_1 += newer * omega_1;
  int learns = m->learning > 0;
  Learnt now = {learns ? r.force : old.force, learns ? r.turn : old.turn,
                learns ? r.force_1 : 0, learns ? r.turn_1 : 0,
                learns ? r.friction : old.friction, old.stiction};
  return now;
}

/* What is wanted of the wheels where `held` will have led to in half a period. */
INLINE Wrench wanted_of(const Law *k, const Track *t, Motion found, Wrench held, Learnt r,
                        double period, double *v_1) {
  const Climber *p = &k->climber;
  Wrench push = {held.drive + r.force, held.turn + r.turn};
  Motion aim = predicted(p, found, push, period / 2, r.friction);
  double turning, speed;
  demand(&k->gains, t, aim, v_1, &turning, &speed);
  double comes = 8 * t->v / (fabs(t->v) + 5 * k->friction_speed);
  double fast = clip(speed / k->friction_speed, -8, 8), waits = clip(1 + fast * comes / 8, 0, 1);
  double stuck = tanh(r.stiction), slides = tanh(0.8 * waits * (fast + comes));
  double rub = (p->friction + r.friction) * (stuck + (1 - fabs(stuck)) * slides);
  Wrench wanted = {p->mass * *v_1 + rub + p->weight * aim.sine - r.force,
                   p->inertia * turning - r.turn};
  return wanted;
}

/* See and answer an odometry of a period ago; what is to be remembered has the answer. */
INLINE Memory answered(const Law *k, Memory m, Motion found, const Track *t, double period) {
  const Climber *p = &k->climber;
  Learnt r = corrected(k, &m, found, period);
  double v_1;
  Wrench guess = limited(p, wanted_of(k, t, found, m.held, r, period, &v_1));
  Wrench wanted = wanted_of(k, t, found, guess, r, period, &v_1), got = limited(p, wanted);
  double fits = (fabs(wanted.drive - got.drive) <= 1e-9) & (fabs(wanted.turn - got.turn) <= 1e-9);
  int held = (fabs(t->v) < 1e-4) & (fabs(found.speed) < 1e-3), same = r.stiction * v_1 >= 0;
  double past = held & same ? r.stiction : clip(r.stiction, -3, 3);
  double change = held ? period * (v_1 / 0.001 - past / 3) : -past;
  r.stiction = clip(past + clip(change, -24 * period, 24 * period), -6, 6);
  Memory now = {found, got, r, fits, fabs(t->v) > SLOW ? sign(t->v) : 0};
  return now;
}

INLINE void torques_of(const Climber *p, Wrench w, double *right, double *left) {
  double mean = p->radius / 2 * w.drive, twist = p->radius / 2 * w.turn / p->half_track;
  *right = mean + twist;
  *left = mean - twist;
}

void tick(const Law *k, Memory *memory, const Motion *found, const Target *target,
          double period, double *torques) {
  Track t = track(&k->gains, target);
  *memory = answered(k, *memory, *found, &t, period);
  torques_of(&k->climber, memory->held, torques, torques + 1);
}

INLINE Motion slid(const Climber *p, Motion m, Wrench w, double direction, double time) {
  double half = time / 2, turning = w.turn / p->inertia, c_1, s_1, c_2, s_2;
  double angle = time * (m.yaw_rate + half * turning);
  rotate(m.cosine, m.sine, half * (m.yaw_rate + half / 2 * turning), &c_1, &s_1);
  rotate(m.cosine, m.sine, angle, &c_2, &s_2);
  double free = (w.drive - direction * p->friction) / p->mass;
  double part = time / 6, fall = part * p->weight / p->mass;
  double v_2 = m.speed + time * free - fall * (m.sine + 4 * s_1 + s_2);
  double v_14 = 2 * (m.speed + v_2) - 3 * fall * (m.sine - s_2);
  Motion end = {m.x + part * (m.speed * m.cosine + v_14 * c_1 + v_2 * c_2),
                m.y + part * (m.speed * m.sine + v_14 * s_1 + v_2 * s_2),
                m.heading + angle, c_2, s_2, v_2, m.yaw_rate + time * turning};
  return end;
}

static Motion from_rest(const Climber *p, Motion m, Wrench w, double time) {
  double push = w.drive - p->weight * m.sine;
  if (fabs(push) > p->friction) return slid(p, m, w, sign(push), time);
  double turning = w.turn / p->inertia, angle = time * (m.yaw_rate + time / 2 * turning);
  m.heading += angle;
  rotate(m.cosine, m.sine, angle, &m.cosine, &m.sine);
  m.yaw_rate += time * turning;
  return m; /* that it gives way while it turns is left out */
}

static Motion advanced(const Climber *p, Motion m, Wrench w, double time) {
  if (m.speed == 0) return from_rest(p, m, w, time);
  double direction = copysign(1, m.speed), until = 0;
  Motion end = slid(p, m, w, direction, time);
  if (end.speed * direction >= 0) return end;
  Motion there = m;
  for (int i = 0; i < 5; i++) {
    double slope = (w.drive - p->weight * there.sine - direction * p->friction) / p->mass;
    until = clip(until - there.speed / slope, 0, time);
    there = slid(p, m, w, direction, until);
  }
  there.speed = 0;
  return from_rest(p, there, w, time - until);
}

/* Climbers side by side: [j][i] is number j, in the order of its struct, of climber i. */
enum { BLOCK = 128 };
typedef double Motions[7][BLOCK];

INLINE Motion motion_of(Motions a, int i) {
  Motion m = {a[0][i], a[1][i], a[2][i], a[3][i], a[4][i], a[5][i], a[6][i]};
  return m;
}

INLINE void put(Motions a, int i, Motion m) {
  a[0][i] = m.x, a[1][i] = m.y, a[2][i] = m.heading, a[3][i] = m.cosine;
  a[4][i] = m.sine, a[5][i] = m.speed, a[6][i] = m.yaw_rate;
}

INLINE Climber climber_of(double a[7][BLOCK], int i) {
  Climber p = {a[0][i], a[1][i], a[2][i], a[3][i], a[4][i], a[5][i], a[6][i]};
  return p;
}

/* All slide on first; those that rest or stop are done again, one by one. */
static void step(double p[7][BLOCK], Motions m, double w[2][BLOCK], double time) {
  Motions end;
  int rare = 0;
  for (int i = 0; i < BLOCK; i++) {
    Climber own = climber_of(p, i);
    Motion now = motion_of(m, i);
    Wrench wrench = {w[0][i], w[1][i]};
    Motion then = slid(&own, now, wrench, copysign(1, now.speed), time);
    rare |= now.speed * then.speed <= 0;
    put(end, i, then);
  }
  if (rare)
    for (int i = 0; i < BLOCK; i++)
      if (m[5][i] * end[5][i] <= 0) {
        Climber own = climber_of(p, i);
        Wrench wrench = {w[0][i], w[1][i]};
        put(end, i, advanced(&own, motion_of(m, i), wrench, time));
      }
  for (int j = 0; j < 7; j++)
    for (int i = 0; i < BLOCK; i++) m[j][i] = end[j][i];
}

/* Rows of n numbers to rows of a block, whose last ones are those of the last climber. */
static void get(int rows, int n, int first, const double *from, double (*to)[BLOCK]) {
  for (int j = 0; j < rows; j++)
    for (int i = 0; i < BLOCK; i++) to[j][i] = from[j * n + (first + i < n ? first + i : n - 1)];
}

static void give(int rows, int n, int first, double (*from)[BLOCK], double *to) {
  for (int j = 0; j < rows; j++)
    for (int i = 0; i < BLOCK && first + i < n; i++) to[j * n + first + i] = from[j][i];
}

/* Steps of n climbers, each under its wrench. */
void open_loops(int n, int steps, double time, const double *climbers, const double *wrenches,
                double *motions) {
  double p[7][BLOCK], w[2][BLOCK];
  Motions m;
  for (int first = 0; first < n; first += BLOCK) {
    get(7, n, first, climbers, p);
    get(2, n, first, wrenches, w);
    get(7, n, first, motions, m);
    for (int k = 0; k < steps; k++) step(p, m, w, time);
    give(7, n, first, m, motions);
  }
}

/* Grip by what is asked of a wheel that has a part of the load. */
INLINE double margin_of(double part, double friction, double drive, double beside) {
  double asked = sqrt(drive * drive + part * part * beside * beside), grip = friction * part;
  return grip < 100 * asked ? grip / asked : 100;
}

/* Ticks of n climbers with their controllers, which share a law: `now` are the references at the
 * odometry, `aims` those that the answers aim at; the wheels carry `load`, the centre of mass is at
 * a `height`. Sums are those of `Sums`, without falls: squares, saturated, worst, last, settled,
 * peak torque, slip margin. */
void closed_loops(int n, int ticks, int steps, double period, const Law *k, const double *climbers,
                  const Target *now, const Target *aims, double load, double friction,
                  double height, double *motions, double *memories, double *sums) {
  double p[7][BLOCK], w[2][BLOCK], memory[17][BLOCK], sum[7][BLOCK];
  Motions m;
  for (int first = 0; first < n; first += BLOCK) {
    get(7, n, first, climbers, p);
    get(7, n, first, motions, m);
    get(17, n, first, memories, memory);
    get(7, n, first, sums, sum);
    for (int j = 0; j < ticks; j++) {
      Track t = track(&k->gains, aims + j);
      double x = now[j].x, y = now[j].y, time = j * period;
      for (int i = 0; i < BLOCK; i++) {
        Motion found = motion_of(m, i);
        Memory old = {motion_of(memory, i),
                      {memory[7][i], memory[8][i]},
                      {memory[9][i], memory[10][i], memory[11][i], memory[12][i], memory[13][i],
                       memory[14][i]},
                      memory[15][i], memory[16][i]};
        Memory is = answered(k, old, found, &t, period);
        put(memory, i, found);
        memory[7][i] = is.held.drive, memory[8][i] = is.held.turn;
        memory[9][i] = is.learnt.force, memory[10][i] = is.learnt.turn;
        memory[11][i] = is.learnt.force_1, memory[12][i] = is.learnt.turn_1;
        memory[13][i] = is.learnt.friction, memory[14][i] = is.learnt.stiction;
        memory[15][i] = is.learning, memory[16][i] = is.direction;
      }
      for (int i = 0; i < BLOCK; i++) {
        Climber own = climber_of(p, i);
        Wrench held = {memory[7][i], memory[8][i]};
        double right, left, dx = m[0][i] - x, dy = m[1][i] - y, far = dx * dx + dy * dy;
        torques_of(&k->climber, held, &right, &left);
        w[0][i] = (right + left) / own.radius;
        w[1][i] = own.half_track * (right - left) / own.radius;
        double beside = own.mass * m[5][i] * m[6][i] + own.weight * m[3][i];
        double more = clip(own.weight * m[3][i] * height / (2 * own.half_track), -load / 2, load / 2);
        double margin = fmin(
            margin_of(load / 2 + more, friction, right / own.radius, beside / load),
            margin_of(load / 2 - more, friction, left / own.radius, beside / load));
        sum[0][i] += far;
        sum[1][i] += 1 - memory[15][i];
        sum[2][i] = fmax(sum[2][i], far);
        sum[3][i] = far;
        sum[4][i] = far > 1e-4 ? time : sum[4][i];
        sum[5][i] = fmax(sum[5][i], fmax(fabs(right), fabs(left)));
        sum[6][i] = fmin(sum[6][i], margin);
      }
      for (int s = 0; s < steps; s++) step(p, m, w, period / steps);
    }
    give(7, n, first, m, motions);
    give(17, n, first, memory, memories);
    give(7, n, first, sum, sums);
  }
}
