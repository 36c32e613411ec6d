/* One motor, one position sensor, one host: protocol and safety of a one-axis haptic board.
 *
 * Plain C99 without a library and without Arduino: the shell around it (one_axis_board.ino) reads the
 * sensor, sets the motor and moves bytes. The protocol is docs/reference/one-axis-board.md.
 *
 * Time is an argument, in microseconds, and may run over. Whatever bytes come, and whenever:
 *   - |axis_drive| is never above the limit of the configuration, and is 0 before the first command;
 *   - it is 0 once no valid force command came for `watchdog_ms`, and stays so until one comes;
 *   - after that, and at the start, it rises to the limit no faster than over `ramp_ms`;
 *   - it is 0 for ever after a fault of the sensor, until the board starts anew.
 */
#ifndef AXIS_CORE_H
#define AXIS_CORE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define AXIS_VERSION 1
#define AXIS_ANSWER 24 /* bytes of the longest answer */
#define AXIS_FORCE_SIZE 7 /* bytes of the longest command */

typedef struct {
  uint16_t limit_ma;    /* most that the motor ever gets [mA] */
  uint16_t full_ma;     /* what it gets at full voltage while it stands still [mA] */
  uint16_t watchdog_ms; /* of silence, after which the motor is off; 20 to 100 */
  uint16_t ramp_ms;     /* from none to the limit after a start or a silence */
  uint16_t counts;      /* of the sensor, per turn of what it measures */
} axis_config;

typedef struct {
  axis_config config;
  int32_t counts;
  int16_t command_ma, given_ma;
  uint32_t heard_us, started_us;
  uint16_t raw;
  uint8_t waiting[AXIS_FORCE_SIZE], length;
  bool live, ramped, tripped, limited, faulty, sensed, pressed;
} axis_state;

/* Begin with the motor off; a configuration that cannot be (see axis_core.c) has a limit of 0. */
void axis_begin(axis_state *axis, const axis_config *config);

/* Take over the counter of an encoder. */
void axis_count(axis_state *axis, int32_t counts);

/* Take over a sensor that begins anew after `range` counts (0 to range - 1), and count its turns.
 * A step of a quarter to three quarters of the range tells no direction, and a value outside the
 * range is none: a fault of the sensor, which stays. */
void axis_wrap(axis_state *axis, uint16_t raw, uint16_t range);

/* Tell whether the button of the board, if it has one, is held. */
void axis_press(axis_state *axis, bool pressed);

/* Take one byte of the host. Returns how many bytes of `answer` are to be sent, often 0. */
uint8_t axis_receive(axis_state *axis, uint8_t byte, uint32_t now_us, uint8_t answer[AXIS_ANSWER]);

/* Current for the motor now [mA], positive toward growing counts. To be called without rest. */
int16_t axis_drive(axis_state *axis, uint32_t now_us);

/* Duty of a bridge without a current sensor for a current [mA], 0 to `most`; see axis_core.c. */
uint8_t axis_duty(const axis_state *axis, int16_t milliamps, uint8_t most);

/* CRC-16/CCITT-FALSE: polynomial 0x1021, begins with 0xFFFF. */
uint16_t axis_crc(const uint8_t *bytes, uint8_t length);

#ifdef __cplusplus
}
#endif
#endif
