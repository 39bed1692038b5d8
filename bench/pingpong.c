/* One end of the ping-pong of bench/messages.py, in C on rcl: serialised messages, no Python.
 *
 * The end that leads publishes an Odometry and waits for the JointState that answers it; the other
 * answers. Prints round trips a second, and the processor time of each in microseconds.
 */
#include <nav_msgs/msg/odometry.h>
#include <rcl/rcl.h>
#include <rmw/serialized_message.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <rosidl_runtime_c/string_functions.h>
#include <sensor_msgs/msg/joint_state.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define CHECK(call) do { if ((call) != RCL_RET_OK) { fprintf(stderr, "%s: %s\n", #call, \
    rcutils_get_error_string().str); exit(1); } } while (0)

static double seconds(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

void pingpong(int leads, double duration) {
  rcl_allocator_t allocator = rcl_get_default_allocator();
  rcl_init_options_t options = rcl_get_zero_initialized_init_options();
  CHECK(rcl_init_options_init(&options, allocator));
  rcl_context_t context = rcl_get_zero_initialized_context();
  CHECK(rcl_init(0, NULL, &options, &context));
  rcl_node_t node = rcl_get_zero_initialized_node();
  rcl_node_options_t node_options = rcl_node_get_default_options();
  CHECK(rcl_node_init(&node, leads ? "pinging" : "ponging", "", &context, &node_options));

  const rosidl_message_type_support_t *odometry =
      ROSIDL_GET_MSG_TYPE_SUPPORT(nav_msgs, msg, Odometry);
  const rosidl_message_type_support_t *torques =
      ROSIDL_GET_MSG_TYPE_SUPPORT(sensor_msgs, msg, JointState);
  rcl_publisher_t publisher = rcl_get_zero_initialized_publisher();
  rcl_publisher_options_t publishing = rcl_publisher_get_default_options();
  CHECK(rcl_publisher_init(&publisher, &node, leads ? odometry : torques,
                           leads ? "ping" : "pong", &publishing));
  rcl_subscription_t subscription = rcl_get_zero_initialized_subscription();
  rcl_subscription_options_t subscribing = rcl_subscription_get_default_options();
  CHECK(rcl_subscription_init(&subscription, &node, leads ? torques : odometry,
                              leads ? "pong" : "ping", &subscribing));

  rcl_serialized_message_t sent = rmw_get_zero_initialized_serialized_message();
  rcl_serialized_message_t got = rmw_get_zero_initialized_serialized_message();
  CHECK(rmw_serialized_message_init(&sent, 1024, &allocator));
  CHECK(rmw_serialized_message_init(&got, 1024, &allocator));
  if (leads) {
    nav_msgs__msg__Odometry message;
    nav_msgs__msg__Odometry__init(&message);
    rosidl_runtime_c__String__assign(&message.header.frame_id, "odom");
    rosidl_runtime_c__String__assign(&message.child_frame_id, "base_link");
    CHECK(rmw_serialize(&message, odometry, &sent));
  } else {
    sensor_msgs__msg__JointState message;
    sensor_msgs__msg__JointState__init(&message);
    rosidl_runtime_c__String__Sequence__init(&message.name, 2);
    rosidl_runtime_c__String__assign(&message.name.data[0], "left_wheel_joint");
    rosidl_runtime_c__String__assign(&message.name.data[1], "right_wheel_joint");
    rosidl_runtime_c__double__Sequence__init(&message.effort, 2);
    CHECK(rmw_serialize(&message, torques, &sent));
  }

  rcl_wait_set_t waiting = rcl_get_zero_initialized_wait_set();
  CHECK(rcl_wait_set_init(&waiting, 1, 0, 0, 0, 0, 0, &context, allocator));
  double begin = seconds(CLOCK_MONOTONIC), used = seconds(CLOCK_PROCESS_CPUTIME_ID);
  long trips = 0;
  while (trips == 0 || seconds(CLOCK_MONOTONIC) - begin < duration) {
    CHECK(rcl_wait_set_clear(&waiting));
    CHECK(rcl_wait_set_add_subscription(&waiting, &subscription, NULL));
    rcl_ret_t waited = rcl_wait(&waiting, RCL_MS_TO_NS(100));
    if (waited == RCL_RET_TIMEOUT) {
      if (trips && !leads) break;
      if (leads) CHECK(rcl_publish_serialized_message(&publisher, &sent, NULL));
      continue;
    }
    CHECK(waited);
    if (rcl_take_serialized_message(&subscription, &got, NULL, NULL) != RCL_RET_OK) continue;
    CHECK(rcl_publish_serialized_message(&publisher, &sent, NULL));
    if (trips++ == 0) begin = seconds(CLOCK_MONOTONIC), used = seconds(CLOCK_PROCESS_CPUTIME_ID);
  }
  double passed = seconds(CLOCK_MONOTONIC) - begin;
  used = seconds(CLOCK_PROCESS_CPUTIME_ID) - used;
  printf("%.1f %.3f\n", trips / passed, 1e6 * used / trips);
  fflush(stdout);
}
