#include "axis_core.h"

#include <string.h>

#define SYNC 0xC5
#define IDENTIFY 'I'
#define FORCE 'F'
#define DESCRIPTION 'D'
#define REPORT 'R'
#define IDENTIFY_SIZE 5
#define FORCE_SIZE AXIS_FORCE_SIZE
#define REPORT_SIZE 16

/* Bits of a report. */
#define FAULTY 1u
#define TRIPPED 2u
#define LIMITED 4u
#define PRESSED 8u

static void put16(uint8_t *at, uint16_t value) {
  at[0] = (uint8_t)value;
  at[1] = (uint8_t)(value >> 8);
}

static void put32(uint8_t *at, uint32_t value) {
  put16(at, (uint16_t)value);
  put16(at + 2, (uint16_t)(value >> 16));
}

static uint16_t take16(const uint8_t *at) { return (uint16_t)(at[0] | at[1] << 8); }

uint16_t axis_crc(const uint8_t *bytes, uint8_t length) {
  uint16_t crc = 0xFFFF;
  for (uint8_t k = 0; k < length; k++) {
    crc = (uint16_t)(crc ^ (uint16_t)bytes[k] << 8);
    for (uint8_t bit = 0; bit < 8; bit++) {
      const uint16_t carry = crc & 0x8000u ? 0x1021 : 0;
      crc = (uint16_t)((uint16_t)(crc << 1) ^ carry);
    }
  }
  return crc;
}

void axis_begin(axis_state *axis, const axis_config *config) {
  memset(axis, 0, sizeof *axis);
  axis->config = *config;
  /* Figures that nobody can mean: no motor is better than one that holds its last force. */
  if (config->watchdog_ms < 20 || config->watchdog_ms > 100 || config->ramp_ms < 100 ||
      config->ramp_ms > 5000 || config->limit_ma > INT16_MAX || config->full_ma > INT16_MAX ||
      config->limit_ma > config->full_ma) {
    axis->config.limit_ma = 0;
  }
}

void axis_count(axis_state *axis, int32_t counts) { axis->counts = counts; }

void axis_press(axis_state *axis, bool pressed) { axis->pressed = pressed; }

void axis_wrap(axis_state *axis, uint16_t raw, uint16_t range) {
  int32_t step = (int32_t)raw - axis->raw;
  if (raw >= range) {
    axis->faulty = true;
    return;
  }
  if (!axis->sensed) {
    axis->sensed = true;
    step = 0;
  } else if (4 * step > 3 * (int32_t)range) {
    step -= range;
  } else if (4 * step < -3 * (int32_t)range) {
    step += range;
  } else if (4 * step > range || 4 * step < -(int32_t)range) {
    axis->faulty = true;
    return;
  }
  axis->raw = raw;
  /* As unsigned: a counter that runs over is no undefined behaviour. */
  axis->counts = (int32_t)((uint32_t)axis->counts + (uint32_t)step);
}

int16_t axis_drive(axis_state *axis, uint32_t now_us) {
  const axis_config *config = &axis->config;
  int32_t allowed = config->limit_ma, wanted = axis->command_ma;
  uint32_t ramp_us = 1000ul * config->ramp_ms;
  if (axis->faulty) axis->live = false;
  if (axis->live && now_us - axis->heard_us > 1000ul * config->watchdog_ms) {
    axis->live = false;
    axis->tripped = true;
  }
  if (!axis->live) {
    axis->command_ma = axis->given_ma = 0;
    return 0;
  }
  if (!axis->ramped) {
    uint32_t passed_ms = (now_us - axis->started_us) / 1000;
    if (now_us - axis->started_us >= ramp_us) {
      axis->ramped = true;
    } else {
      allowed = (int32_t)(passed_ms * config->limit_ma / config->ramp_ms);
    }
  }
  axis->limited = wanted > allowed || wanted < -allowed;
  if (wanted > allowed) wanted = allowed;
  if (wanted < -allowed) wanted = -allowed;
  axis->given_ma = (int16_t)wanted;
  return axis->given_ma;
}

/* A bridge sets a voltage. A motor that stands still then has a current in proportion; one that the
 * hand turns has less or more by its own voltage, which is damping, and which the limit of the supply
 * bounds: full_ma has to be below what motor and bridge stand for ever. */
uint8_t axis_duty(const axis_state *axis, int16_t milliamps, uint8_t most) {
  uint32_t full = axis->config.full_ma, size = (uint32_t)(milliamps < 0 ? -(int32_t)milliamps : milliamps);
  if (full == 0) return 0;
  if (size >= full) return most;
  return (uint8_t)(size * most / full);
}

static uint8_t seal(uint8_t *answer, uint8_t size) {
  put16(answer + size - 2, axis_crc(answer + 1, (uint8_t)(size - 3)));
  return size;
}

static uint8_t describe(const axis_state *axis, uint8_t sequence, uint8_t *answer) {
  answer[0] = SYNC;
  answer[1] = DESCRIPTION;
  answer[2] = sequence;
  memcpy(answer + 3, "cohaptic", 8);
  answer[11] = AXIS_VERSION;
  put16(answer + 12, axis->config.limit_ma);
  put16(answer + 14, axis->config.full_ma);
  put16(answer + 16, axis->config.watchdog_ms);
  put16(answer + 18, axis->config.ramp_ms);
  put16(answer + 20, axis->config.counts);
  return seal(answer, AXIS_ANSWER);
}

static uint8_t report(axis_state *axis, uint8_t sequence, uint32_t now_us, uint8_t *answer) {
  unsigned flags = (axis->faulty ? FAULTY : 0u) | (axis->tripped ? TRIPPED : 0u) |
                   (axis->limited ? LIMITED : 0u) | (axis->pressed ? PRESSED : 0u);
  axis->tripped = false; /* told once */
  answer[0] = SYNC;
  answer[1] = REPORT;
  answer[2] = sequence;
  answer[3] = (uint8_t)flags;
  put32(answer + 4, now_us);
  put32(answer + 8, (uint32_t)axis->counts);
  put16(answer + 12, (uint16_t)axis->given_ma);
  return seal(answer, REPORT_SIZE);
}

static uint8_t obey(axis_state *axis, uint32_t now_us, uint8_t *answer) {
  const uint8_t *frame = axis->waiting;
  if (frame[1] == IDENTIFY) return describe(axis, frame[2], answer); /* feeds no watchdog */
  (void)axis_drive(axis, now_us); /* a silence that is over was one, whenever the shell looked */
  if (!axis->live && !axis->faulty) {
    axis->live = true;
    axis->ramped = false;
    axis->started_us = now_us;
  }
  axis->heard_us = now_us;
  axis->command_ma = axis->faulty ? 0 : (int16_t)take16(frame + 3);
  (void)axis_drive(axis, now_us);
  return report(axis, frame[2], now_us, answer);
}

static uint8_t size_of(uint8_t kind) {
  return kind == IDENTIFY ? IDENTIFY_SIZE : kind == FORCE ? FORCE_SIZE : 0;
}

static void drop(axis_state *axis, uint8_t bytes) {
  axis->length = (uint8_t)(axis->length - bytes);
  memmove(axis->waiting, axis->waiting + bytes, axis->length);
}

uint8_t axis_receive(axis_state *axis, uint8_t byte, uint32_t now_us, uint8_t answer[AXIS_ANSWER]) {
  uint8_t sent = 0;
  axis->waiting[axis->length++] = byte;
  while (axis->length > 0) {
    const uint8_t *frame = axis->waiting;
    uint8_t size = axis->length > 1 ? size_of(frame[1]) : FORCE_SIZE;
    if (frame[0] != SYNC || size == 0) {
      drop(axis, 1);
    } else if (axis->length < size) {
      break;
    } else if (take16(frame + size - 2) != axis_crc(frame + 1, (uint8_t)(size - 3))) {
      drop(axis, 1); /* a frame may begin within one that is none */
    } else {
      sent = obey(axis, now_us, answer); /* seven bytes hold one: no second answer */
      drop(axis, size);
    }
  }
  return sent;
}
