/* The controller's law and the plain climber once more, in C: the limit for `bench/tick.py` and
 * `bench/batch.py`. Guidance, observer and limits as in climber_uk/control, the step as in
 * climber_uk/closed_loop/unicycle.py; both benchmarks refuse to run if it gives something else. */
#include <math.h>

typedef struct { double x, y, heading, cosine, sine, speed, yaw_rate; } Motion;
typedef struct { double drive, turn; } Wrench;
typedef struct { double x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y; } Target;
typedef struct { double mass, inertia, radius, half_track, friction, weight, limit; } Climber;
typedef struct { double k_x, k_y, rate, omega_n, v_s, v_c, fastest; } Gains;
typedef struct { Climber climber; Gains gains; double friction_speed, bandwidth; } Controller;
typedef struct { Motion motion; Wrench held, disturbance; int learning; } Memory;
typedef struct {
  double x, y, heading, cosine, sine, v, v_1, omega, omega_1;
  double wait, wait_1, hurry, hurry_1, g, g_1, g_2;
} Track;

static double sign(double x) { return (x > 0) - (x < 0); }
static double clip(double x, double low, double high) { return fmin(fmax(x, low), high); }

/* The series is as long as it has to be for a turn below 0.03; see `elementary.rotated`. */
static void rotate(double c, double s, double angle, double *cosine, double *sine) {
  double q = angle * angle, dc, ds;
  if (q < 9e-4) {
    dc = 1 - q * (1.0 / 2 - q * (1.0 / 24 - q * (1.0 / 720)));
    ds = angle * (1 - q * (1.0 / 6 - q * (1.0 / 120 - q * (1.0 / 5040))));
  } else {
    dc = cos(angle);
    ds = sin(angle);
  }
  *cosine = dc * c - ds * s;
  *sine = ds * c + dc * s;
}

static Motion rolled(const Climber *p, Motion m, Wrench w, double time) {
  double half = time / 2, omega_1 = w.turn / p->inertia, c, s;
  rotate(m.cosine, m.sine, half * (m.yaw_rate + half / 2 * omega_1), &c, &s);
  double push = w.drive - p->weight * s;
  double rub = fabs(m.speed) > 0.01 ? copysign(p->friction, m.speed)
                                    : clip(push, -p->friction, p->friction);
  double v_1 = (push - rub) / p->mass, way = time * (m.speed + half * v_1);
  double angle = time * (m.yaw_rate + half * omega_1);
  Motion end = {m.x + way * c, m.y + way * s, m.heading + angle, 0, 0,
                m.speed + time * v_1, m.yaw_rate + time * omega_1};
  rotate(m.cosine, m.sine, angle, &end.cosine, &end.sine);
  return end;
}

static Track track(const Gains *k, const Target *t) {
  double c = cos(t->heading), s = sin(t->heading);
  double v = t->v_x * c + t->v_y * s, v_1 = t->a_x * c + t->a_y * s;
  double v_2 = t->j_x * c + t->j_y * s + t->omega * t->omega * v;
  double fade = k->v_s * k->v_s, root = sqrt(v * v + fade), slope = fade / (root * root * root);
  double curvature = -3 * v * slope / (root * root), wait = sqrt(v * v + fade / 4);
  Track found = {t->x, t->y, t->heading, c, s, v, v_1, t->omega, t->omega_1,
                 wait, v * v_1 / wait, k->v_s / 2 + k->v_c * fabs(v) / root,
                 k->v_c * sign(v) * slope * v_1, k->k_y * v / root, k->k_y * slope * v_1,
                 k->k_y * (curvature * v_1 * v_1 + slope * v_2)};
  return found;
}

static void demand(const Gains *k, const Track *t, Motion m, double *v_1, double *turning,
                   double *wanted) {
  double dx = m.x - t->x, dy = m.y - t->y, turned = m.heading - t->heading;
  turned -= 2 * M_PI * floor(turned / (2 * M_PI) + 0.5);
  double e_x = dx * t->cosine + dy * t->sine, e_y = dy * t->cosine - dx * t->sine;
  double v_x = m.speed * (m.cosine * t->cosine + m.sine * t->sine);
  double sine_e = m.sine * t->cosine - m.cosine * t->sine;
  double omega = m.yaw_rate - t->omega;
  double e_x1 = v_x - t->v + t->omega * e_y, e_y1 = m.speed * sine_e - t->omega * e_x;
  int ahead = e_x * t->v > 0;
  double most = ahead ? t->wait : t->hurry, most_1 = ahead ? t->wait_1 : t->hurry_1;
  double u = k->k_x * e_x / most, part = tanh(u), inside = 1 - part * part;
  *wanted = t->v - most * part;
  *v_1 = t->v_1 - (k->k_x * inside * e_x1 + (part - u * inside) * most_1) -
         k->rate * (m.speed - *wanted);
  double e_y2 = *v_1 * sine_e + v_x * omega - t->omega_1 * e_x - t->omega * e_x1;
  double w = t->g * e_y, w_1 = t->g_1 * e_y + t->g * e_y1;
  double w_2 = t->g_2 * e_y + 2 * t->g_1 * e_y1 + t->g * e_y2;
  double slope = 1 / (1 + w * w), steered = slope * w_1, led = turned + atan(w);
  double led_1 = omega + steered, led_2 = slope * w_2 - 2 * w * steered * steered;
  part = tanh(k->omega_n * led / k->fastest);
  *turning = t->omega_1 - led_2 -
             k->omega_n * ((1 - part * part) * led_1 + led_1 + k->fastest * part);
}

static Wrench limited(const Climber *p, Wrench w) {
  double to_mean = p->radius / 2, to_twist = to_mean / p->half_track, most = p->limit;
  double mean = to_mean * w.drive, twist = to_twist * w.turn;
  if (fabs(mean + twist) <= most && fabs(mean - twist) <= most) return w;
  twist = clip(twist, -most, most);
  double left = most - fabs(twist);
  Wrench got = {clip(mean, -left, left) / to_mean, twist / to_twist};
  return got;
}

/* See and answer an odometry of a period ago, and leave what is to be remembered. */
void tick(const Controller *k, Memory *memory, const Motion *found, const Target *target,
          double period, double *torques) {
  const Climber *p = &k->climber;
  Wrench r = memory->disturbance, acting = {memory->held.drive + r.drive,
                                            memory->held.turn + r.turn};
  Motion expected = rolled(p, memory->motion, acting, period);
  double share = (1 - exp(-k->bandwidth * period)) / period;
  if (memory->learning) {
    r.drive += p->mass * share * (found->speed - expected.speed);
    r.turn += p->inertia * share * (found->yaw_rate - expected.yaw_rate);
  }
  Track t = track(&k->gains, target);
  Wrench wanted, got = memory->held;
  for (int i = 0; i < 2; i++) {
    Wrench push = {got.drive + r.drive, got.turn + r.turn};
    Motion aim = rolled(p, *found, push, period / 2);
    double v_1, turning, speed;
    demand(&k->gains, &t, aim, &v_1, &turning, &speed);
    wanted.drive = p->mass * v_1 + p->friction * tanh(speed / k->friction_speed) +
                   p->weight * aim.sine - r.drive;
    wanted.turn = p->inertia * turning - r.turn;
    got = limited(p, wanted);
  }
  memory->learning = fabs(wanted.drive - got.drive) <= 1e-9 && fabs(wanted.turn - got.turn) <= 1e-9;
  memory->motion = *found;
  memory->held = got;
  memory->disturbance = r;
  double mean = p->radius / 2 * got.drive, twist = p->radius / 2 * got.turn / p->half_track;
  torques[0] = mean + twist;
  torques[1] = mean - twist;
}

static Motion slid(const Climber *p, Motion m, Wrench w, double direction, double time) {
  double half = time / 2, turning = w.turn / p->inertia, c_1, s_1;
  rotate(m.cosine, m.sine, half * (m.yaw_rate + half / 2 * turning), &c_1, &s_1);
  double angle = time * (m.yaw_rate + half * turning), c_2, s_2;
  rotate(m.cosine, m.sine, angle, &c_2, &s_2);
  double free = (w.drive - direction * p->friction) / p->mass;
  double part = time / 6, fall = part * p->weight / p->mass;
  double v_1 = m.speed + half * free - fall * (1.25 * m.sine + 2 * s_1 - 0.25 * s_2);
  double v_2 = m.speed + time * free - fall * (m.sine + 4 * s_1 + s_2);
  Motion end = {m.x + part * (m.speed * m.cosine + 4 * v_1 * c_1 + v_2 * c_2),
                m.y + part * (m.speed * m.sine + 4 * v_1 * s_1 + v_2 * s_2),
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

/* As `rotate`, without a branch that keeps the compiler from doing eight at once. */
static inline void rotate_small(double c, double s, double angle, double *cosine, double *sine) {
  double q = angle * angle;
  double dc = 1 - q * (1.0 / 2 - q * (1.0 / 24 - q * (1.0 / 720)));
  double ds = angle * (1 - q * (1.0 / 6 - q * (1.0 / 120 - q * (1.0 / 5040))));
  *cosine = dc * c - ds * s;
  *sine = ds * c + dc * s;
}

/* Steps of n climbers, each under its wrench: rows of n numbers in the order of the structs. All
 * slide on first; those that stop, rest or turn fast are done again. */
void open_loops(int n, int steps, double time, const Climber *p, const double *w, double *m) {
  enum { BLOCK = 256 };
  double end[7][BLOCK];
  for (int first = 0; first < n; first += BLOCK) {
    int many = n - first < BLOCK ? n - first : BLOCK;
    const double *restrict drive = w + first, *restrict turn = w + n + first;
    double *restrict x = m + first, *restrict y = x + n, *restrict heading = y + n;
    double *restrict c = heading + n, *restrict s = c + n, *restrict v = s + n;
    double *restrict omega = v + n;
    double half = time / 2, part = time / 6, fall = part * p->weight / p->mass;
    for (int k = 0; k < steps; k++) {
      for (int i = 0; i < many; i++) {
        double turning = turn[i] / p->inertia, c_1, s_1, c_2, s_2;
        double angle = time * (omega[i] + half * turning);
        rotate_small(c[i], s[i], half * (omega[i] + half / 2 * turning), &c_1, &s_1);
        rotate_small(c[i], s[i], angle, &c_2, &s_2);
        double free = (drive[i] - copysign(p->friction, v[i])) / p->mass;
        double v_1 = v[i] + half * free - fall * (1.25 * s[i] + 2 * s_1 - 0.25 * s_2);
        double v_2 = v[i] + time * free - fall * (s[i] + 4 * s_1 + s_2);
        end[0][i] = x[i] + part * (v[i] * c[i] + 4 * v_1 * c_1 + v_2 * c_2);
        end[1][i] = y[i] + part * (v[i] * s[i] + 4 * v_1 * s_1 + v_2 * s_2);
        end[2][i] = heading[i] + angle;
        end[3][i] = c_2;
        end[4][i] = s_2;
        end[5][i] = v_2;
        end[6][i] = omega[i] + time * turning;
      }
      for (int i = 0; i < many; i++)
        if (!(v[i] * end[5][i] > 0) || !(fabs(end[2][i] - heading[i]) < 0.03)) {
          Motion now = {x[i], y[i], heading[i], c[i], s[i], v[i], omega[i]};
          Wrench own = {drive[i], turn[i]};
          now = advanced(p, now, own, time);
          end[0][i] = now.x, end[1][i] = now.y, end[2][i] = now.heading, end[3][i] = now.cosine;
          end[4][i] = now.sine, end[5][i] = now.speed, end[6][i] = now.yaw_rate;
        }
      for (int j = 0; j < 7; j++)
        for (int i = 0; i < many; i++) m[j * n + first + i] = end[j][i];
    }
  }
}

/* Ticks of n climbers with their controllers; targets are those that the answers aim at. */
void closed_loops(int n, int ticks, int steps, double period, const Controller *k,
                  const Climber *p, const Target *aims, Motion *m, Memory *memories) {
  for (int i = 0; i < n; i++) {
    Memory memory = memories[i];
    for (int j = 0; j < ticks; j++) {
      double torques[2];
      tick(k + i, &memory, m + i, aims + j, period, torques);
      Wrench w = {(torques[0] + torques[1]) / p[i].radius,
                  p[i].half_track * (torques[0] - torques[1]) / p[i].radius};
      for (int s = 0; s < steps; s++) m[i] = advanced(p + i, m[i], w, period / steps);
    }
    memories[i] = memory;
  }
}
