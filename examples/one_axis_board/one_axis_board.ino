// The shell for a Hapkit board (ATmega328 at 16 MHz, L298 bridge, magnetoresistive sensor): pins,
// timers and bytes. What is safe about it is in axis_core.c. UNTESTED: no board was at hand.
//
// For another board change this file only: an encoder calls axis_count in place of axis_wrap.

#include <Arduino.h>
#include <avr/wdt.h>

#include "axis_core.h"

namespace {

const uint8_t kPwm = 5, kDirection = 8, kSensor = A2;  // of motor 1 and the sensor on the board
const long kBaud = 500000;  // exact at 16 MHz: a command and its report take 0.5 ms
const uint8_t kMostDuty = 255;

// ASSUMPTIONS about the unit, to be measured with a meter before the motor is connected:
// the supply over the motor's resistance, half of which its winding stands for minutes.
const axis_config kConfig = {
    /* limit_ma */ 500, /* full_ma */ 1000, /* watchdog_ms */ 50, /* ramp_ms */ 500, /* counts */ 2048,
};
const uint16_t kRange = 1024;  // of the converter, after which the sensor begins anew: half a turn

axis_state axis;
uint32_t now_us;
uint16_t ticks;  // of timer 1, half a microsecond each

// Timer 0, by which millis() and micros() go, drives the PWM without a prescaler and runs 64 times too
// fast for them. Timer 1 runs freely; it has to be read every 32 ms, which the watchdog below demands.
uint32_t timeNow() {
  const uint16_t passed = (uint16_t)(TCNT1 - ticks) & ~1u;
  ticks += passed;
  now_us += passed / 2;
  return now_us;
}

void drive(int16_t milliamps) {
  digitalWrite(kDirection, milliamps < 0 ? HIGH : LOW);
  analogWrite(kPwm, axis_duty(&axis, milliamps, kMostDuty));
}

}  // namespace

void setup() {
  pinMode(kPwm, OUTPUT);
  pinMode(kDirection, OUTPUT);
  analogWrite(kPwm, 0);
  TCCR0B = (TCCR0B & 0xF8) | 0x01;  // PWM at 62.5 kHz, which nobody hears
  TCCR1A = 0;
  TCCR1B = 0x02;  // clock / 8
  ADCSRA = (ADCSRA & 0xF8) | 0x05;  // a conversion takes 26 us in place of 104
  axis_begin(&axis, &kConfig);
  Serial.begin(kBaud);
  // A loop that hangs would hold its last PWM: this resets the board within 60 ms, and its pins with
  // it. An old boot loader then stays in resets until the supply is cut; the motor is off all the while.
  wdt_enable(WDTO_60MS);
}

void loop() {
  wdt_reset();
  axis_wrap(&axis, (uint16_t)analogRead(kSensor), kRange);
  // A host that floods the board with bytes must not keep the motor from its watchdog.
  for (uint8_t most = 32; most > 0 && Serial.available() > 0; most--) {
    uint8_t answer[AXIS_ANSWER];
    const uint8_t size = axis_receive(&axis, (uint8_t)Serial.read(), timeNow(), answer);
    // An answer that finds no room is left out: to wait for room would be to hold the force.
    if (size > 0 && Serial.availableForWrite() >= size) Serial.write(answer, size);
  }
  drive(axis_drive(&axis, timeNow()));
}
