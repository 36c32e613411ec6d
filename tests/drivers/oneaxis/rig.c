/* The real firmware core, with a motor, a handle and a hand behind it, for the tests of the driver.
 *
 * The handle is a mass on the hand's spring; its motor pulls it, and its sensor counts it. */
#include <math.h>
#include <stdlib.h>

#include "axis_core.c"

typedef struct {
  axis_state axis;
  double place, speed;  /* of the handle, away from the user [m, m/s] */
  double goal, aim;     /* of the hand, and where it is on its way there [m] */
  double newtons;       /* for an ampere, at the handle */
  double per_metre;     /* counts */
  double direction;     /* of motor and sensor, 1 or -1 */
  double most;          /* current that the motor ever had [A] */
  int broken;           /* whether the sensor is gone */
} rig;

#define MASS 0.08
#define STIFFNESS 400.0
#define DAMPING 8.0
#define REACH_SPEED 0.15 /* m/s */

rig *rig_new(int limit_ma, int watchdog_ms, int counts, double newtons, double per_metre) {
  rig *r = calloc(1, sizeof *r);
  axis_config config = {(uint16_t)limit_ma, 1000, (uint16_t)watchdog_ms, 500, (uint16_t)counts};
  axis_begin(&r->axis, &config);
  r->newtons = newtons;
  r->per_metre = per_metre;
  r->direction = 1.0;
  return r;
}

void rig_free(rig *r) { free(r); }
void rig_goal(rig *r, double goal) { r->goal = goal; }
void rig_turn(rig *r, double direction) { r->direction = direction; }
void rig_break(rig *r) { r->broken = 1; }
void rig_press(rig *r, int pressed) { axis_press(&r->axis, pressed != 0); }
double rig_place(rig *r) { return r->place; }
double rig_most(rig *r) { return r->most; }
void rig_wrap(rig *r, int raw, int range) { axis_wrap(&r->axis, (uint16_t)raw, (uint16_t)range); }
int rig_counts(rig *r) { return r->axis.counts; }
int rig_duty(rig *r, int ma, int most) { return axis_duty(&r->axis, (int16_t)ma, (uint8_t)most); }

int rig_receive(rig *r, int byte, unsigned now_us, unsigned char *answer) {
  return axis_receive(&r->axis, (uint8_t)byte, now_us, answer);
}

int rig_drive(rig *r, unsigned now_us) { return axis_drive(&r->axis, now_us); }

/* Move on by dt [s] in steps of at most 0.1 ms; returns the current [A]. */
double rig_step(rig *r, unsigned now_us, double dt) {
  double ampere = 1e-3 * axis_drive(&r->axis, now_us);
  if (fabs(ampere) > r->most) r->most = fabs(ampere);
  int steps = (int)ceil(dt / 1e-4);
  double most = REACH_SPEED * dt, way = r->goal - r->aim;
  r->aim += fmax(-most, fmin(most, way));
  for (int k = 0; k < steps; k++) {
    double force = r->direction * ampere * r->newtons + STIFFNESS * (r->aim - r->place);
    r->speed = (r->speed + force / MASS * dt / steps) / (1.0 + DAMPING / MASS * dt / steps);
    r->place += r->speed * dt / steps;
  }
  axis_count(&r->axis, (int32_t)lround(r->direction * r->per_metre * r->place));
  if (r->broken) axis_wrap(&r->axis, 9, 9);
  return ampere;
}
