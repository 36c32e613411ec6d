// Presses the object of a room at one place, holds, and leaves: a whole hand at 1 kHz.
//
//     press URL NAME SECONDS DEPTH [PX PY PZ  IX IY IZ]
//     press ws://127.0.0.1:8765 ann 5 0.008
//
// SECONDS is how long it holds, DEPTH how far the tip goes behind the point P of the surface at
// rest, along the unit vector I into the object [m]; without P and I, from the left to the middle.
// Prints a line of JSON each 0.1 s: time [s], tip [m], force [N], k_o [N/m], phase.
//
// SPDX-License-Identifier: Apache-2.0

#include "cohaptic.hpp"

#include <cstdio>
#include <cstdlib>
#include <thread>

using cohaptic::Vec3;

namespace {

constexpr double CLEARANCE = 0.01;  // m before the surface, where a hand gets engaged
constexpr double SPEED = 0.01;      // m/s, of a slow press
constexpr double ENGAGED = 1.3;     // s until the whole force is given, with time for a patch

/// How far the tip is along its way, at a time [s] after the start [m].
double way_at(double t, double depth) {
    return std::min(CLEARANCE + depth, SPEED * std::max(0.0, t - ENGAGED)) - CLEARANCE;
}

void run(cohaptic::Hand &hand, Vec3 point, Vec3 inward, double seconds, double depth) {
    using clock = std::chrono::steady_clock;
    const auto start = clock::now();
    auto due = start;
    const double arrived = ENGAGED + (CLEARANCE + depth) / SPEED;
    for (long period = 0;; ++period) {
        const double t = std::chrono::duration<double>(clock::now() - start).count();
        const bool leaving = t > arrived + seconds;
        if (leaving) hand.let_go();
        const Vec3 tip = point + inward * way_at(t, depth);
        const Vec3 force = hand.step(tip);  // here a device would get its force
        if (period % 100 == 0 || (leaving && hand.free())) {
            const char *phase = leaving ? "leaves" : t > arrived ? "holds" : "presses";
            std::printf("{\"t\":%.3f,\"tip\":[%.6f,%.6f,%.6f],\"force\":[%.6f,%.6f,%.6f],"
                        "\"k_o\":%.4f,\"depth\":%.6f,\"phase\":\"%s\"}\n",
                        t, tip.x, tip.y, tip.z, force.x, force.y, force.z, hand.k_o(),
                        std::max(-1.0, hand.depth()), phase);
            std::fflush(stdout);
        }
        if (leaving && hand.free()) return;
        due = std::max(due + std::chrono::milliseconds(1), clock::now());  // none is made up for
        std::this_thread::sleep_until(due);
    }
}

}  // namespace

int main(int count, char **words) {
    if (count != 5 && count != 11) {
        std::fprintf(stderr, "usage: press URL NAME SECONDS DEPTH [PX PY PZ IX IY IZ]\n");
        return 2;
    }
    try {
        double v[8] = {};
        for (int i = 3; i < count; ++i) v[i - 3] = std::atof(words[i]);
        cohaptic::Settings settings;
        settings.stall = 1.0;  // nobody holds this hand: a busy machine is no fault
        cohaptic::Hand hand(words[1], words[2], settings);
        const cohaptic::Welcome &room = hand.welcome();
        Vec3 point = room.center - Vec3{room.radius, 0.0, 0.0}, inward{1.0, 0.0, 0.0};
        if (count == 11) {
            point = {v[2], v[3], v[4]};
            inward = cohaptic::unit({v[5], v[6], v[7]}, inward);
        }
        run(hand, point, inward, v[0], v[1]);
    } catch (const cohaptic::Error &error) {
        std::fprintf(stderr, "press: %s\n", error.what());
        return 1;
    }
}
