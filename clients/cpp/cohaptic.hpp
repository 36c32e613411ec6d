// A hand of cohaptic in C++17: one header, with nothing but the sockets of the system.
//
//     #include "cohaptic.hpp"
//     cohaptic::Hand hand("ws://127.0.0.1:8765", "ann");
//     for (;;) {  // a thousand times a second
//         const cohaptic::Vec3 force = hand.step(tip, velocity);  // m, m/s, N; never waits
//     }
//
// `Loop` is the core, without socket and clock: bytes and times go in, forces and bytes come out.
// `Hand` is a `Loop` at a websocket. docs/how-to/join-from-another-language.md explains both, and
// docs/protocol.md is the authority on every message. The rules have the names and the order of
// client/cohaptic_client/loop/chain.py, whose vectors (tests/vectors) they reproduce.
//
// It runs the law `predictive` on planes and spheres, with the damping of the passivity layer. It
// leaves out friction with its compliance, and the models of the other hands with the trust in
// them: `LACKING` names these rules, and the hello tells them to the server. It speaks ws: and not
// wss:, joins once and does not come back by itself after a lost connection.
//
// Lengths are in metres, forces in newtons, times in seconds, all in the frame of the room, whose z
// points up. Errors are exceptions below `cohaptic::Error`, and name the value and its limit.
//
// SPDX-License-Identifier: Apache-2.0

#ifndef COHAPTIC_HPP
#define COHAPTIC_HPP

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <iterator>
#include <limits>
#include <locale>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX  // the macros min and max of Windows would replace those of <algorithm>
#endif
#include <winsock2.h>
#include <ws2tcpip.h>
#ifdef _MSC_VER
#pragma comment(lib, "ws2_32.lib")
#endif
#else
#include <cerrno>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>
#endif

namespace cohaptic {

// ---------------------------------------------------------------------------------------- errors

/// Base of all that this header throws on purpose.
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A setting, or a value that the program gave, is outside its limits.
struct SettingError : Error {
    using Error::Error;
};

/// What the server sent breaks docs/protocol.md.
struct ProtocolError : Error {
    using Error::Error;
};

/// The server cannot be reached, or the connection is lost.
struct ConnectionError : Error {
    using Error::Error;
};

/// The server refused this hand, or put it out, and said why.
struct Refused : Error {
    Refused(int code_, std::string field_, const std::string &message)
        : Error("the server refused: " + message), code(code_), field(std::move(field_)) {}
    int code;           ///< a close code of docs/protocol.md
    std::string field;  ///< field, message or resource at fault; may be empty
};

namespace detail {

/// A number as in C, whatever the locale of the program.
template <class Number>
std::string text_of(Number value, int digits = 6) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(digits);
    out << value;
    return out.str();
}

/// The text of a peer as it may stand in an error: one line of at most 200 printable characters.
inline std::string one_line(const std::string &text) {
    std::string line;
    for (const char c : text.substr(0, 200)) {
        const auto code = static_cast<unsigned char>(c);
        line += code < 0x20 || code == 0x7f ? ' ' : c;
    }
    return line;
}

template <class E = ProtocolError>
[[noreturn]] void refuse(const std::string &name, const std::string &value,
                         const std::string &limit) {
    throw E(name + " is " + one_line(value) + "; expected " + limit);
}

/// Throws unless low <= value <= high; a NaN throws, too.
template <class E = ProtocolError>
void check_range(const char *name, double value, double low, double high) {
    if (!(low <= value && value <= high)) {
        refuse<E>(name, text_of(value), "from " + text_of(low) + " to " + text_of(high));
    }
}

template <class E = ProtocolError>
void check_finite(const char *name, double value) {
    if (!std::isfinite(value)) refuse<E>(name, text_of(value), "a finite number");
}

}  // namespace detail

// --------------------------------------------------------------------------------------- vectors

/// A place [m], displacement [m], velocity [m/s] or force [N] in the frame of the room.
struct Vec3 {
    double x = 0.0, y = 0.0, z = 0.0;
};

inline Vec3 operator+(const Vec3 &a, const Vec3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3 &a, const Vec3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(const Vec3 &a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline bool operator==(const Vec3 &a, const Vec3 &b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}
inline bool operator!=(const Vec3 &a, const Vec3 &b) { return !(a == b); }
inline double dot(const Vec3 &a, const Vec3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double norm(const Vec3 &a) { return std::sqrt(dot(a, a)); }
inline bool is_finite(const Vec3 &a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// The unit vector along `a`, or `fallback` where `a` has hardly a length.
inline Vec3 unit(const Vec3 &a, const Vec3 &fallback) {
    const double length = norm(a);
    return length > 1e-12 ? a * (1.0 / length) : fallback;
}

/// On the way from `a` (s = 0) to `b` (s = 1).
inline Vec3 lerp(const Vec3 &a, const Vec3 &b, double s) { return a + (b - a) * s; }

// ---------------------------------------------------------------------------------------- frames

using Bytes = std::vector<std::uint8_t>;

namespace wire {

// <generated: by `make protocol` from shared/cohaptic/protocol/layout.py; change that instead>
constexpr int PROTOCOL_VERSION = 6;
constexpr const char *SUBPROTOCOL = "cohaptic.v6";
constexpr std::size_t HEAD_SIZE = 4;
enum class Geometry : unsigned { Plane = 1, Sphere = 2, Mesh = 3 };
enum class Law : unsigned { Proportional = 1, Pi = 2, Predictive = 3 };
constexpr double MAX_POSITION = 10;  // m
constexpr double MAX_FORCE = 100;  // N
constexpr double MAX_STIFFNESS = 1000000;  // N/m
constexpr double MIN_COMPLIANCE = 1e-06;  // m/N, of fixed and rigid parts
constexpr double MAX_CURVATURE = 10000;  // 1/m, of a patch
constexpr double MAX_LAG = 60;  // s
constexpr double MAX_COUPLING = 1000;
constexpr double MAX_GAIN_CUT = 60000;  // N/m, in a tick's ledger
constexpr double MAX_COMPLIANCE = 10;  // m/N
constexpr double MAX_CUT = 300;  // N, in a tick's ledger
constexpr double MIN_PERIOD = 0.005;  // s, of the simulation
constexpr double MAX_PERIOD = 0.1;  // s
constexpr double MAX_FRAME_BYTES = 1536;  // of a binary message to who touches
constexpr double MAX_TEXT = 16384;  // characters of a message to who touches
constexpr double MAX_TOKEN = 2048;  // characters

// Position of the tip, and force on the hand.
namespace at_contact_sample {
constexpr unsigned KIND = 1;
constexpr std::size_t SIZE = 44;
constexpr std::size_t seq = 4;  // u32
constexpr std::size_t tick = 8;  // u32
constexpr std::size_t t_client = 12;  // f64 [s]
constexpr std::size_t probe = 20;  // 3 f32 [m]
constexpr std::size_t force = 32;  // 3 f32 [N]
}  // namespace at_contact_sample

// Surface in front of one user, free of the user's own force, and gains of the law.
namespace at_patch {
constexpr unsigned KIND = 2;
constexpr std::size_t SIZE = 116;
constexpr std::size_t tick = 4;  // u32
constexpr std::size_t seq = 8;  // u32
constexpr std::size_t t_server = 12;  // f64 [s]
constexpr std::size_t t_client = 20;  // f64 [s]
constexpr std::size_t sample_wait = 28;  // f32 [s]
constexpr std::size_t x_free = 32;  // 3 f32 [m]
constexpr std::size_t normal = 44;  // 3 f32 [1]
constexpr std::size_t curvature = 56;  // f32 [1/m]
constexpr std::size_t c_ii = 60;  // f32 [m/N]
constexpr std::size_t k_h = 64;  // f32 [N/m]
constexpr std::size_t integral_gain = 68;  // f32 [N/(m s)]
constexpr std::size_t own_force = 72;  // 3 f32 [N]
constexpr std::size_t u_others = 84;  // 3 f32 [m]
constexpr std::size_t lag = 96;  // f32 [s]
constexpr std::size_t coupling = 100;  // f16 [1]
constexpr std::size_t margin = 102;  // f16 [1]
constexpr std::size_t by_presence = 104;  // f16 [N]
constexpr std::size_t by_limit = 106;  // f16 [N]
constexpr std::size_t by_anticipation = 108;  // f16 [N]
constexpr std::size_t by_lag = 110;  // f16 [N]
constexpr std::size_t by_rate = 112;  // f16 [N]
constexpr std::size_t gain_cut = 114;  // f16 [N/m]
}  // namespace at_patch
// <end of what is generated>

}  // namespace wire

namespace detail {

// Frames are little-endian; shifts read and write them on every machine.
static_assert(std::numeric_limits<float>::is_iec559 && sizeof(float) == 4, "IEEE 754 is needed");
static_assert(std::numeric_limits<double>::is_iec559 && sizeof(double) == 8, "IEEE 754 is needed");

/// Reads the fields of a frame whose length was checked.
struct Reader {
    const std::uint8_t *data;

    std::uint64_t bits(std::size_t at, std::size_t bytes) const {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i) {
            value |= static_cast<std::uint64_t>(data[at + i]) << (8 * i);
        }
        return value;
    }
    std::uint32_t u32(std::size_t at) const { return static_cast<std::uint32_t>(bits(at, 4)); }
    double f64(std::size_t at) const {
        const std::uint64_t raw = bits(at, 8);
        double value;
        std::memcpy(&value, &raw, sizeof value);
        return value;
    }
    double f32(std::size_t at) const {
        const std::uint32_t raw = u32(at);
        float value;
        std::memcpy(&value, &raw, sizeof value);
        return static_cast<double>(value);
    }
    /// A half: a sign, 5 bits of exponent, 10 of the fraction.
    double f16(std::size_t at) const {
        const auto raw = static_cast<unsigned>(bits(at, 2));
        const int exponent = static_cast<int>(raw >> 10 & 0x1fu);
        const double fraction = static_cast<double>(raw & 0x3ffu);
        double value;
        if (exponent == 0) {
            value = std::ldexp(fraction, -24);
        } else if (exponent == 31) {
            value = fraction == 0.0 ? std::numeric_limits<double>::infinity()
                                    : std::numeric_limits<double>::quiet_NaN();
        } else {
            value = std::ldexp(fraction + 1024.0, exponent - 25);
        }
        return raw & 0x8000u ? -value : value;
    }
    Vec3 vec(std::size_t at) const { return {f32(at), f32(at + 4), f32(at + 8)}; }
};

/// Writes the fields of a frame into bytes that are long enough.
struct Writer {
    Bytes &data;

    void bits(std::size_t at, std::uint64_t value, std::size_t bytes) {
        for (std::size_t i = 0; i < bytes; ++i) {
            data[at + i] = static_cast<std::uint8_t>(value >> (8 * i) & 0xffu);
        }
    }
    void f64(std::size_t at, double value) {
        std::uint64_t raw;
        std::memcpy(&raw, &value, sizeof raw);
        bits(at, raw, 8);
    }
    void f32(std::size_t at, double value) {
        const float rounded = static_cast<float>(value);
        std::uint32_t raw;
        std::memcpy(&raw, &rounded, sizeof raw);
        bits(at, raw, 4);
    }
    void vec(std::size_t at, const Vec3 &value) {
        f32(at, value.x);
        f32(at + 4, value.y);
        f32(at + 8, value.z);
    }
};

template <class E = ProtocolError>
void check_length(const char *name, const Vec3 &value, double limit, const char *unit) {
    if (!(norm(value) <= limit)) {
        refuse<E>(std::string("length of ") + name, text_of(norm(value)) + ' ' + unit,
                  "at most " + text_of(limit) + ' ' + unit);
    }
}

}  // namespace detail

/// Tip and force of one time, from the client to the server.
struct ContactSample {
    std::uint32_t seq = 1;   ///< counts this client's samples, from 1
    std::uint32_t tick = 0;  ///< of the newest patch that was used; 0 for none
    double t_client = 0.0;   ///< when it was taken, client's clock [s]
    Vec3 probe;              ///< tip [m]
    Vec3 force;              ///< on the hand, whose opposite the body gets [N]

    /// The frame; throws SettingError for a value beyond its limit.
    Bytes encode() const {
        namespace at = wire::at_contact_sample;
        detail::check_range<SettingError>("seq", seq, 1.0, 4294967295.0);
        detail::check_finite<SettingError>("t_client", t_client);
        detail::check_length<SettingError>("probe", probe, wire::MAX_POSITION, "m");
        detail::check_length<SettingError>("force", force, wire::MAX_FORCE, "N");
        Bytes frame(at::SIZE, 0);
        detail::Writer out{frame};
        out.bits(0, static_cast<std::uint64_t>(wire::PROTOCOL_VERSION), 1);
        out.bits(1, at::KIND, 1);
        out.bits(at::seq, seq, 4);
        out.bits(at::tick, tick, 4);
        out.f64(at::t_client, t_client);
        out.vec(at::probe, probe);
        out.vec(at::force, force);
        return frame;
    }
};

/// The surface in front of this hand, free of its own force, and the gain of its law.
struct Patch {
    std::uint32_t tick = 1;     ///< of the simulation, rising
    std::uint32_t seq = 0;      ///< sample that this surface contains; 0 for none
    double t_server = 0.0;      ///< time of the tick, server's clock [s]
    double t_client = 0.0;      ///< of that sample, sent back [s]
    double sample_wait = 0.0;   ///< how long that sample waited for the tick [s]
    Vec3 x_free;                ///< contact point of the free surface [m]
    Vec3 normal{0.0, 0.0, 1.0}; ///< outward unit normal there
    double curvature = 0.0;     ///< 0 for a plane, 1 / radius where the body bulges [1/m]
    double c_ii = 1.0;          ///< compliance of the contact [m/N]; k_o = 1 / c_ii
    double k_h = 0.0;           ///< gain that the server chose [N/m]
    Vec3 own_force;             ///< on this hand, as the body carries it at the tick [N]
    Vec3 u_others;              ///< displacement of the material by the others [m]
    double lag = 0.0;           ///< of the room [s]

    /// The patch in a frame; throws ProtocolError for anything but a plane or a sphere for the law
    /// `predictive`, with every value within its limits.
    static Patch decode(const std::uint8_t *data, std::size_t size) {
        namespace at = wire::at_patch;
        using detail::text_of;
        const detail::Reader in{data};
        if (size < wire::HEAD_SIZE) {
            detail::refuse("frame length", text_of(size), "at least 4 bytes");
        }
        if (data[0] != wire::PROTOCOL_VERSION) {
            detail::refuse("frame's protocol version", text_of(int{data[0]}),
                           text_of(wire::PROTOCOL_VERSION));
        }
        if (data[1] != at::KIND) detail::refuse("frame kind", text_of(int{data[1]}), "2 (patch)");
        const auto flags = static_cast<unsigned>(in.bits(2, 2));
        const unsigned shape = flags & 0xfu, law = flags >> 4 & 0xfu;
        if (shape != static_cast<unsigned>(wire::Geometry::Plane) &&
            shape != static_cast<unsigned>(wire::Geometry::Sphere)) {
            detail::refuse("geometry of a patch", text_of(shape), "1 (plane) or 2 (sphere)");
        }
        if (law != static_cast<unsigned>(wire::Law::Predictive)) {
            detail::refuse("law of a patch", text_of(law), "3 (predictive), which was asked for");
        }
        if (flags >> 8 != 0) {
            detail::refuse("flags of a patch", text_of(flags),
                           "no compliance and no partners, which were not asked for");
        }
        if (size != at::SIZE) {
            detail::refuse("patch length", text_of(size),
                           text_of(at::SIZE) + " bytes");
        }
        Patch patch;
        patch.tick = in.u32(at::tick);
        patch.seq = in.u32(at::seq);
        patch.t_server = in.f64(at::t_server);
        patch.t_client = in.f64(at::t_client);
        patch.sample_wait = in.f32(at::sample_wait);
        patch.x_free = in.vec(at::x_free);
        patch.normal = in.vec(at::normal);
        patch.curvature = in.f32(at::curvature);
        patch.c_ii = in.f32(at::c_ii);
        patch.k_h = in.f32(at::k_h);
        patch.own_force = in.vec(at::own_force);
        patch.u_others = in.vec(at::u_others);
        patch.lag = in.f32(at::lag);
        patch.check();
        // Not used here; a frame in which they are wrong is broken all the same.
        detail::check_range("integral_gain", in.f32(at::integral_gain), 0.0, 1e9);
        detail::check_range("coupling", in.f16(at::coupling), 0.0, wire::MAX_COUPLING);
        if (!(in.f16(at::margin) >= 0.0)) {
            detail::refuse("margin", text_of(in.f16(at::margin)), "0 or more");
        }
        for (const std::size_t entry : {at::by_presence, at::by_limit, at::by_anticipation,
                                        at::by_lag, at::by_rate}) {
            detail::check_range("entry of a tick's ledger", in.f16(entry), -wire::MAX_CUT,
                                wire::MAX_CUT);
        }
        detail::check_range("gain_cut", in.f16(at::gain_cut), 0.0, wire::MAX_GAIN_CUT);
        return patch;
    }

    /// Throws ProtocolError unless every value is finite and within its limits.
    void check() const {
        constexpr double rounding = 1e-6;  // 32 bits may round c_ii by so much over its limits
        detail::check_range("tick of a patch", tick, 1.0, 4294967295.0);
        detail::check_finite("t_server", t_server);
        detail::check_finite("t_client", t_client);
        detail::check_range("sample_wait", sample_wait, 0.0, 1e6);
        detail::check_length("x_free", x_free, wire::MAX_POSITION, "m");
        detail::check_range("length of normal", norm(normal), 0.999, 1.001);
        detail::check_range("curvature", curvature, -wire::MAX_CURVATURE, wire::MAX_CURVATURE);
        detail::check_range("c_ii", c_ii, wire::MIN_COMPLIANCE * (1.0 - rounding),
                            wire::MAX_COMPLIANCE * (1.0 + rounding));
        detail::check_range("k_h", k_h, 0.0, wire::MAX_STIFFNESS);
        detail::check_length("own_force", own_force, wire::MAX_FORCE, "N");
        detail::check_length("u_others", u_others, wire::MAX_POSITION, "m");
        detail::check_range("lag of the room", lag, 0.0, wire::MAX_LAG);
    }
};

// ------------------------------------------------------------------------------------------ JSON

/// A value of JSON. Numbers are doubles; an object keeps the order of its members.
struct Json {
    enum class Kind { Null, Boolean, Number, Text, List, Object };
    Kind kind = Kind::Null;
    bool boolean = false;
    double number = 0.0;
    std::string text;
    std::vector<Json> items;
    std::vector<std::pair<std::string, Json>> members;

    /// Deepest nesting, and most values: the fullest room's welcome has 3 levels and 600 values.
    static constexpr int MAX_DEPTH = 8;
    static constexpr int MAX_VALUES = 8192;

    /// Reads a text; throws ProtocolError for anything that is not JSON, is too deep or too long.
    static Json parse(const std::string &text);

    /// A member of an object; null where there is none.
    const Json *find(const std::string &name) const {
        for (const auto &member : members) {
            if (member.first == name) return &member.second;
        }
        return nullptr;
    }
    /// A member of the wanted kind; throws ProtocolError where there is none.
    const Json &at(const std::string &name, Kind wanted) const {
        const Json *found = find(name);
        if (found == nullptr) detail::refuse("field '" + name + "'", "not there", "one");
        if (found->kind != wanted) {
            detail::refuse("field '" + name + "'", kind_name(found->kind), kind_name(wanted));
        }
        return *found;
    }
    const std::string &text_at(const std::string &name) const { return at(name, Kind::Text).text; }
    /// A number within limits; throws ProtocolError.
    double number_at(const std::string &name, double low, double high) const {
        const double value = at(name, Kind::Number).number;
        detail::check_range(name.c_str(), value, low, high);
        return value;
    }
    /// A whole number within limits; throws ProtocolError.
    long long integer_at(const std::string &name, double low, double high) const {
        const double value = number_at(name, low, high);
        if (std::floor(value) != value) detail::refuse(name, detail::text_of(value), "an integer");
        return static_cast<long long>(value);
    }

    static const char *kind_name(Kind kind) {
        static constexpr const char *names[] = {"null",   "true or false", "a number",
                                                "a text", "a list",        "an object"};
        return names[static_cast<int>(kind)];
    }
};

/// A text as JSON, with its quotes; control characters are escaped.
inline std::string quoted(const std::string &text) {
    static constexpr char digits[] = "0123456789abcdef";
    std::string out = "\"";
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (code < 0x20) {
            out += "\\u00";
            out += digits[code >> 4];
            out += digits[code & 15];
        } else {
            out += c;
        }
    }
    return out + '"';
}

namespace detail {

/// Whether bytes are UTF-8 (RFC 3629): no overlong form, no surrogate, nothing above U+10FFFF.
inline bool is_utf8(const std::string &text) {
    std::size_t i = 0;
    while (i < text.size()) {
        const auto first = static_cast<unsigned char>(text[i]);
        const std::size_t more = first < 0x80 ? 0 : first < 0xc2 ? 9 : first < 0xe0 ? 1
                                 : first < 0xf0 ? 2 : first < 0xf5 ? 3 : 9;
        if (more == 9 || text.size() - i <= more) return false;
        for (std::size_t k = 1; k <= more; ++k) {
            const auto next = static_cast<unsigned char>(text[i + k]);
            if ((next & 0xc0) != 0x80) return false;
            const bool low = (first == 0xe0 && next < 0xa0) || (first == 0xf0 && next < 0x90);
            const bool high = (first == 0xed && next > 0x9f) || (first == 0xf4 && next > 0x8f);
            if (k == 1 && (low || high)) return false;
        }
        i += more + 1;
    }
    return true;
}

/// The reader of `Json::parse`.
class JsonReader {
public:
    explicit JsonReader(const std::string &text) : text_(text) {}

    Json whole() {
        Json found = value(1);
        skip_blanks();
        if (at_ != text_.size()) fail("more text");
        return found;
    }

private:
    const std::string &text_;
    std::size_t at_ = 0;
    int values_ = 0;

    [[noreturn]] void fail(const char *what) const {
        refuse("JSON at character " + text_of(at_), what,
               "a value as in RFC 8259");
    }
    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
    bool take(char c) {
        if (at_ >= text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }
    void skip_blanks() {
        while (at_ < text_.size() && std::strchr(" \t\r\n", text_[at_]) != nullptr &&
               text_[at_] != '\0') {
            ++at_;
        }
    }
    void word(const char *expected) {
        const std::size_t size = std::strlen(expected);
        if (text_.compare(at_, size, expected) != 0) fail("no value");
        at_ += size;
    }

    Json value(int depth) {
        if (depth > Json::MAX_DEPTH) {
            refuse("depth of JSON", text_of(depth), "at most " + text_of(Json::MAX_DEPTH));
        }
        if (++values_ > Json::MAX_VALUES) {
            refuse("values in JSON", text_of(values_), "at most " + text_of(Json::MAX_VALUES));
        }
        skip_blanks();
        Json found;
        const char c = peek();
        if (c == '{') {
            object(found, depth);
        } else if (c == '[') {
            list(found, depth);
        } else if (c == '"') {
            found.kind = Json::Kind::Text;
            found.text = string();
        } else if (c == 't' || c == 'f') {
            word(c == 't' ? "true" : "false");
            found.kind = Json::Kind::Boolean;
            found.boolean = c == 't';
        } else if (c == 'n') {
            word("null");
        } else {
            found.kind = Json::Kind::Number;
            found.number = numeral();
        }
        return found;
    }
    void object(Json &into, int depth) {
        into.kind = Json::Kind::Object;
        ++at_;
        skip_blanks();
        if (take('}')) return;
        do {
            skip_blanks();
            if (peek() != '"') fail("no name");
            std::string name = string();
            if (into.find(name) != nullptr) fail("a name for the second time");
            skip_blanks();
            if (!take(':')) fail("no colon");
            Json item = value(depth + 1);
            into.members.emplace_back(std::move(name), std::move(item));
            skip_blanks();
        } while (take(','));
        if (!take('}')) fail("an object without an end");
    }
    void list(Json &into, int depth) {
        into.kind = Json::Kind::List;
        ++at_;
        skip_blanks();
        if (take(']')) return;
        do {
            into.items.push_back(value(depth + 1));
            skip_blanks();
        } while (take(','));
        if (!take(']')) fail("a list without an end");
    }
    unsigned hexadecimal() {
        unsigned code = 0;
        for (int i = 0; i < 4; ++i) {
            const char c = peek();
            const bool digit = c >= '0' && c <= '9';
            const bool lower = c >= 'a' && c <= 'f', upper = c >= 'A' && c <= 'F';
            if (!digit && !lower && !upper) fail("an escape without four digits");
            code = code * 16 + static_cast<unsigned>(digit ? c - '0' : lower ? c - 'a' + 10
                                                                             : c - 'A' + 10);
            ++at_;
        }
        return code;
    }
    void append(std::string &out, unsigned code) {
        const auto byte = [&out](unsigned bits) { out += static_cast<char>(bits); };
        if (code < 0x80) {
            byte(code);
        } else if (code < 0x800) {
            byte(0xc0 | code >> 6);
            byte(0x80 | (code & 0x3f));
        } else if (code < 0x10000) {
            byte(0xe0 | code >> 12);
            byte(0x80 | (code >> 6 & 0x3f));
            byte(0x80 | (code & 0x3f));
        } else {
            byte(0xf0 | code >> 18);
            byte(0x80 | (code >> 12 & 0x3f));
            byte(0x80 | (code >> 6 & 0x3f));
            byte(0x80 | (code & 0x3f));
        }
    }
    std::string string() {
        std::string out;
        ++at_;
        for (;;) {
            if (at_ >= text_.size()) fail("a text without an end");
            const char c = text_[at_++];
            if (c == '"') return out;
            if (static_cast<unsigned char>(c) < 0x20) fail("a control character");
            if (c != '\\') {
                out += c;
                continue;
            }
            const char escape = peek();
            if (escape == 'u') {
                ++at_;
                unsigned code = hexadecimal();
                if (code >= 0xd800 && code < 0xdc00 && take('\\') && take('u')) {
                    const unsigned low = hexadecimal();
                    if (low < 0xdc00 || low > 0xdfff) fail("half a pair of surrogates");
                    code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
                } else if (code >= 0xd800 && code < 0xe000) {
                    fail("half a pair of surrogates");
                }
                append(out, code);
                continue;
            }
            static constexpr char escapes[] = "\"\\/bfnrt", meanings[] = "\"\\/\b\f\n\r\t";
            const char *found = escape == '\0' ? nullptr : std::strchr(escapes, escape);
            if (found == nullptr) fail("an escape that there is not");
            out += meanings[found - escapes];
            ++at_;
        }
    }
    bool digits() {
        const std::size_t before = at_;
        while (peek() >= '0' && peek() <= '9') ++at_;
        return at_ > before;
    }
    double numeral() {
        const std::size_t start = at_;
        take('-');
        if (!take('0') && !digits()) fail("no value");
        if (take('.') && !digits()) fail("a point without digits");
        if (take('e') || take('E')) {
            if (!take('+')) take('-');
            if (!digits()) fail("an exponent without digits");
        }
        // Not strtod, which reads a comma where the program's locale has one.
        std::istringstream in(text_.substr(start, at_ - start));
        in.imbue(std::locale::classic());
        double number = 0.0;
        in >> number;
        if (in.fail() || !std::isfinite(number)) fail("a number that no double holds");
        return number;
    }
};

}  // namespace detail

inline Json Json::parse(const std::string &text) {
    // As docs/protocol.md counts: a character has at most four bytes.
    detail::check_range("bytes of a control message", static_cast<double>(text.size()), 2.0,
                        4.0 * wire::MAX_TEXT);
    if (!detail::is_utf8(text)) detail::refuse("control message", "no UTF-8", "UTF-8");
    return detail::JsonReader(text).whole();
}

// -------------------------------------------------------------------------------------- settings

/// Rules of client/cohaptic_client/loop/chain.py that this loop does without.
constexpr const char *LACKING[] = {"models", "compliance", "friction", "trust"};

/// Largest change of the force that the hand's own motion does not cause [N/s]: 0.02 N in a
/// millisecond. A fingertip notices changes from about 0.05 N in 20 ms.
constexpr double EXTERNAL_RATE = 20.0;
/// Of fades [N/s]: half of that, so that the surface keeps the other half.
constexpr double FADE_RATE = 10.0;
/// Largest damping of the passivity layer [N s/m].
constexpr double MAX_DAMPING = 8.0;

/// What the program says of its device, and the limits of the force on its hand. The values are
/// those of client/cohaptic_client/loop/safety.py, which has their reasons.
struct Settings {
    double max_force = 10.0;        ///< of the force on the hand [N], above 0, at most 100
    double max_stiffness = 1000.0;  ///< that the device renders stably [N/m], at most 1e6
    /// Damping that the passivity layer may render [N s/m], 0 to 8; 0 switches it off. A device
    /// with the physical damping b renders `damping_limit(b, max_stiffness)` (Colgate's bound).
    double max_damping = 0.0;
    wire::Geometry geometry = wire::Geometry::Plane;  ///< of the patches: plane or sphere
    bool latch = true;              ///< whether a fault takes the force until acknowledged
    double max_speed = 1.5;         ///< of a hand [m/s]; a faster one is a broken sensor
    double stall = 0.02;            ///< a longer period is a fault [s]
    double engage_time = 1.0;       ///< least time from no force to the whole one [s]
    std::string token;              ///< of an invitation; empty for none
    std::string key;                ///< secret of 16 to 64 characters that keeps the name; or empty
    double patience = 10.0;         ///< for the server's welcome [s]

    /// Throws SettingError for a value outside its limits.
    void check() const {
        using detail::check_range;
        check_range<SettingError>("max_force", max_force, 1e-3, wire::MAX_FORCE);
        check_range<SettingError>("max_stiffness", max_stiffness, 1e-3, wire::MAX_STIFFNESS);
        check_range<SettingError>("max_damping", max_damping, 0.0, MAX_DAMPING);
        check_range<SettingError>("max_speed", max_speed, 1e-3, 100.0);
        check_range<SettingError>("stall", stall, 2e-3, 1.0);
        check_range<SettingError>("engage_time", engage_time, 0.01, 10.0);
        check_range<SettingError>("patience", patience, 0.01, 600.0);
        if (geometry == wire::Geometry::Mesh) {
            throw SettingError("geometry is mesh; it must be plane or sphere");
        }
        check_range<SettingError>("characters of the token", static_cast<double>(token.size()),
                                  0.0, wire::MAX_TOKEN);
        if (!key.empty()) {
            check_range<SettingError>("characters of the key", static_cast<double>(key.size()),
                                      16.0, 64.0);
        }
    }
};

/// Largest damping that a device renders passively beside a stiffness [N s/m]: b > K T / 2 + |B|.
inline double damping_limit(double damping, double stiffness, double period = 0.001) {
    return std::min(MAX_DAMPING, std::max(0.0, damping - 0.5 * stiffness * period));
}

/// The first message of a connection, as JSON; throws SettingError.
inline std::string hello(const std::string &name, const Settings &settings) {
    settings.check();
    detail::check_range<SettingError>("bytes of the name", static_cast<double>(name.size()), 1.0,
                                      128.0);
    if (!detail::is_utf8(name)) throw SettingError("name is no UTF-8; it must be UTF-8");
    const auto number = [](double value) { return detail::text_of(value, 17); };
    const bool sphere = settings.geometry == wire::Geometry::Sphere;
    std::string text = "{\"type\":\"hello\",\"protocol\":" + number(wire::PROTOCOL_VERSION);
    text += ",\"name\":" + quoted(name) + ",\"law\":\"predictive\"";
    text += ",\"max_stiffness\":" + number(settings.max_stiffness);
    text += ",\"max_force\":" + number(settings.max_force);
    text += ",\"damping_budget\":" + number(settings.max_damping);
    text += std::string(",\"geometry\":\"") + (sphere ? "sphere" : "plane") + '"';
    text += ",\"friction\":false,\"fixed_gains\":null";
    if (!settings.key.empty()) text += ",\"key\":" + quoted(settings.key);
    if (!settings.token.empty()) text += ",\"token\":" + quoted(settings.token);
    text += ",\"models\":false,\"rules\":{\"added\":[],\"lacking\":[";
    for (std::size_t i = 0; i < std::size(LACKING); ++i) {
        text += (i == 0 ? "" : ",") + quoted(LACKING[i]);
    }
    return text + "]}}";
}

/// The server's answer to a hello that it takes.
struct Welcome {
    long long user = 0;              ///< number of this hand in the room
    std::string name;                ///< by which it joined
    double simulation_period = 0.0;  ///< time between patches [s]
    std::string body;                ///< name of the object
    Vec3 center;                     ///< of a sphere that holds the resting surface [m]
    double radius = 0.0;             ///< of that sphere [m]

    /// Reads the message; throws ProtocolError.
    static Welcome read(const Json &message) {
        Welcome welcome;
        message.integer_at("protocol", wire::PROTOCOL_VERSION, wire::PROTOCOL_VERSION);
        welcome.user = message.integer_at("user", 0.0, 9e15);
        welcome.name = message.text_at("name");
        welcome.simulation_period =
            message.number_at("simulation_period", wire::MIN_PERIOD, wire::MAX_PERIOD);
        const Json &body = message.at("body", Json::Kind::Object);
        welcome.body = body.text_at("name");
        welcome.radius = body.number_at("radius", 0.0, wire::MAX_POSITION);
        const Json &center = body.at("center", Json::Kind::List);
        if (center.items.size() != 3) {
            detail::refuse("coordinates of 'center'",
                           detail::text_of(center.items.size()), "3");
        }
        double at[3];
        for (std::size_t i = 0; i < 3; ++i) {
            const Json &item = center.items[i];
            if (item.kind != Json::Kind::Number) {
                detail::refuse("field 'center'", Json::kind_name(item.kind), "three numbers");
            }
            detail::check_range("center", item.number, -wire::MAX_POSITION, wire::MAX_POSITION);
            at[i] = item.number;
        }
        welcome.center = {at[0], at[1], at[2]};
        return welcome;
    }
};

// -------------------------------------------------------------------------------- surface and law

/// A surface as seen from one place of the tip.
struct Sight {
    double depth = 0.0;  ///< of the tip below the free surface, negative outside [m]
    Vec3 normal;         ///< outward unit normal at the foot of the tip
    double c_ii = 1.0;   ///< compliance of a contact there [m/N]
    Vec3 own_force;      ///< on this hand, as the body carries it [N]
    Vec3 u_others;       ///< displacement of the material by the others [m]
};

/// The surface of a patch from a tip [m]: a plane, or a sphere that bends away from it.
inline Sight look(const Patch &patch, const Vec3 &tip) {
    const Vec3 out = tip - patch.x_free;
    const double height = dot(out, patch.normal), c = patch.curvature;
    Sight sight{-height, patch.normal, patch.c_ii, patch.own_force, patch.u_others};
    if (c != 0.0) {
        const double s = std::sqrt(std::max(0.0, 1.0 + 2.0 * c * height + c * c * dot(out, out)));
        sight.depth = -(2.0 * height + c * dot(out, out)) / (1.0 + s);  // without cancellation
        sight.normal = unit(patch.normal + out * c, patch.normal);
    }
    return sight;
}

/// Between two sights, from `a` (s = 0) to `b` (s = 1), so that a new patch makes no step.
inline Sight blend(const Sight &a, const Sight &b, double s) {
    if (s >= 1.0) return b;
    if (s <= 0.0) return a;
    return {a.depth + s * (b.depth - a.depth),
            a.normal == b.normal ? b.normal : unit(lerp(a.normal, b.normal, s), b.normal),
            a.c_ii + s * (b.c_ii - a.c_ii), lerp(a.own_force, b.own_force, s),
            lerp(a.u_others, b.u_others, s)};
}

/// a - b, for `shift`; its normal is a difference of unit normals.
inline Sight difference(const Sight &a, const Sight &b) {
    return {a.depth - b.depth, a.normal - b.normal, a.c_ii - b.c_ii, a.own_force - b.own_force,
            a.u_others - b.u_others};
}

inline Sight shift(const Sight &a, const Sight &by) {
    const bool same = by.normal == Vec3{};
    return {a.depth + by.depth, same ? a.normal : unit(a.normal + by.normal, a.normal),
            a.c_ii + by.c_ii, a.own_force + by.own_force, a.u_others + by.u_others};
}

/// The predictive law: gain [N/m] times the depth below the free surface [m]; 0 outside [N].
inline double predictive_force(double depth, double k_h) { return depth > 0.0 ? k_h * depth : 0.0; }

// --------------------------------------------------------------------------------- playing patches

/// When to show what comes over a link that wavers (shared/cohaptic/control/playout.py): behind the
/// server's time by the age of the newest patch that one in a hundred exceeds.
class Playout {
public:
    static constexpr double LONGEST = 0.25;  ///< s over the least age; beyond, the link stalls

    double behind = 0.0;  ///< own clock less the playing time [s]
    double wanted = 0.0;  ///< what that glides to [s]

    static Playout begun(double behind) {
        Playout playout;
        playout.behind = playout.wanted = behind;
        return playout;
    }
    /// Whether a patch that is so old when it comes [s] is of the same clock.
    bool fits(double age) const { return std::fabs(age - wanted) <= ANOTHER; }

    /// The newest patch was found to be so old [s] when it was needed.
    void measured(double age, double now) {
        if (now >= until_) {
            until_ = now + (before_.ages.empty() ? BEGINNING : WINDOW);
            before_ = recent_;
            recent_ = Window{};
        }
        recent_.add(age);
        wanted = largest();
    }
    /// After a time [s], at whose end the newest patch has that age [s].
    void advanced(double dt, double age) {
        behind += std::max(-GLIDE * dt, std::min(GLIDE * dt, wanted - behind));
        behind = std::min(std::max(behind, age), wanted + LONGEST);
    }

private:
    static constexpr double FRACTION = 0.01;  // of the ages that may be larger
    static constexpr double WINDOW = 5.0;     // s; an age counts for one to two of them
    static constexpr double BEGINNING = 1.5;  // s; of the first two: samples find their phase
    static constexpr double GLIDE = 0.25;     // s/s, by which playing is slower or quicker
    static constexpr double ANOTHER = 2.0;    // s; so much only another clock differs
    static constexpr std::size_t KEPT = 16;   // largest ages of a window

    struct Window {
        std::vector<double> ages;  // largest first
        int count = 0;
        double least = std::numeric_limits<double>::infinity();

        void add(double age) {
            ages.insert(std::upper_bound(ages.begin(), ages.end(), age, std::greater<double>()),
                        age);
            if (ages.size() > KEPT) ages.pop_back();
            ++count;
            least = std::min(least, age);
        }
    };
    Window recent_, before_;
    double until_ = -std::numeric_limits<double>::infinity();

    double largest() const {
        std::vector<double> ages = recent_.ages;
        ages.insert(ages.end(), before_.ages.begin(), before_.ages.end());
        std::sort(ages.begin(), ages.end(), std::greater<double>());
        const auto beyond = static_cast<std::size_t>(FRACTION * (recent_.count + before_.count));
        return std::min(ages[std::min(beyond, ages.size() - 1)],
                        std::min(recent_.least, before_.least) + LONGEST);
    }
};

/// When samples leave: each so that it reaches the server just before its tick
/// (client/cohaptic_client/network/timing.py).
struct Pacer {
    static constexpr double TARGET_WAIT = 0.002;  ///< s; for the jitter of two schedulers
    static constexpr double GAIN = 0.1;           ///< of the error that one report corrects

    double period = 0.0;  ///< between samples, that of the simulation [s]
    double due = 0.0;     ///< when the next one leaves [s]

    /// A sample has left at `now` [s]; those that are overdue are left out.
    void sent(double now) {
        const double missed = std::max(0.0, std::trunc((now - due) / period));
        due += (missed + 1.0) * period;
    }
    /// The server has said how long the sample that left at `sent_at` waited for its tick [s].
    void reported(double sent_at, double sample_wait) {
        const double right = sent_at + sample_wait - std::min(TARGET_WAIT, 0.5 * period);
        // Earlier or later, whichever is nearer: only the phase matters.
        const double error = std::fmod(right - due + 0.5 * period, period);
        due += GAIN * ((error < 0.0 ? error + period : error) - 0.5 * period);
    }
};

// ------------------------------------------------------------------------------------- the guard

/// Memory of the safety layer.
struct Guard {
    enum class Mode { Waiting, Engaged, Fault };
    Mode mode = Mode::Waiting;   ///< a hand gets no force until it was free of the object
    double scale = 0.0;          ///< share of the wanted force that the hand gets, 0 to 1
    Vec3 force;                  ///< that it got in the last period [N]
    int quiet = 0;               ///< periods in a row in which little was asked for
    std::optional<double> now;   ///< time of the last period [s]
    std::string fault;           ///< why the force was taken away; empty once it is back
    Vec3 released;               ///< force at the fault [N]
    double left = 0.0;           ///< of the release, 1 to 0
    double own = 0.0;            ///< change that the own motion explains, held back so far [N]
    Vec3 velocity;               ///< of the hand in the last period [m/s]
    double catch_up = 0.0;       ///< rate of the force after the loop stood still [N/s]
};

/// Limits of the guard, as `SafetyLimits` of client/cohaptic_client/loop/safety.py.
struct Limits {
    double max_force = 10.0;      ///< N
    double max_rate = 1000.0;     ///< N/s
    double max_speed = 1.5;       ///< m/s
    double stall = 0.02;          ///< s
    double silent_after = 0.1;    ///< s without a patch
    double fade_time = 0.15;      ///< s, at least, from the whole force to none
    double engage_time = 1.0;     ///< s, at least, back
    double engage_below = 0.2;    ///< N; a hand that is asked for less may be engaged
    int engage_periods = 4;       ///< after so many such periods
    double period = 0.001;        ///< s; a late period moves the force as two of these do
    double stale = 0.002;         ///< s; age of a place that a device may report
    bool latch = false;           ///< whether a fault has to be acknowledged
};

/// What the guard has to know of a period.
struct Asked {
    Vec3 force;                 ///< of law and damping [N]
    Vec3 velocity;              ///< of the hand [m/s]
    double now = 0.0;           ///< s
    double dt = 0.0;            ///< since the last period [s]
    double counted = 0.0;       ///< the same, at most two periods [s]
    bool silent = true;         ///< whether the server is
    bool surface = false;       ///< whether there is one
    bool had_patch = false;     ///< whether there ever was one
    double pressing = 0.0;      ///< depth over compliance: a soft law engages no hand [N]
    double fade_limit = 0.0;    ///< of a fade [N]
    double own = 0.0;           ///< change of the force that the own motion explains [N]
    double damping = 0.0;       ///< larger one of this period's and the last one's [N s/m]
    std::string trouble;        ///< of the device; empty for none
};

namespace detail {

constexpr double RELEASE_TIME = 0.02;   // s from a fault to no force, without a jerk
constexpr double STOOD_STILL = 0.02;    // s; after a longer period the force follows slowly
constexpr double FORGET_OWN = 0.03;     // s in which max_rate passes what it held back
constexpr double BACKSTOP = 1.0 + 1e-9;  // of EXTERNAL_RATE; the rest is for rounding

inline Guard release(const Guard &before, const std::string &fault, const Asked &asked,
                     bool latched) {
    Guard after;
    const bool begun = before.left > 0.0;
    after.released = begun ? before.released : before.force;
    after.left = std::max(0.0, (begun ? before.left : 1.0) - asked.counted / RELEASE_TIME);
    after.force = after.released * (after.left * after.left * (3.0 - 2.0 * after.left));
    after.mode = latched ? Guard::Mode::Fault : Guard::Mode::Waiting;
    after.fault = fault.empty() ? before.fault : fault;
    after.now = asked.now;
    return after;
}

inline std::string fault_of(const Asked &asked, const Limits &limits) {
    if (!asked.trouble.empty()) return asked.trouble;
    if (!is_finite(asked.force)) return "the law asked for a force that is no number";
    const double speed = norm(asked.velocity);
    if (!(speed <= limits.max_speed)) {
        return "the hand moved at " + text_of(speed, 3) + " m/s, above " +
               text_of(limits.max_speed) + " m/s";
    }
    if (asked.dt > limits.stall) {
        return "the loop stood still for " + text_of(1e3 * asked.dt, 3) + " ms, above " +
               text_of(1e3 * limits.stall) + " ms";
    }
    return "";
}

}  // namespace detail

/// The rules `fault`, `limit`, `fade` and `rate`, for any force: the guard after a period.
inline Guard guarded(const Guard &before, const Asked &asked, const Limits &limits) {
    using Mode = Guard::Mode;
    const std::string fault = detail::fault_of(asked, limits);
    if (!fault.empty() || before.left > 0.0) {
        const bool latched = before.mode == Mode::Fault || (limits.latch && !fault.empty());
        return detail::release(before, fault, asked, latched);
    }
    // Limit, before the fade: a force beyond the limit must not hold up a fade.
    const double size = norm(asked.force);
    Vec3 wanted = size > limits.max_force ? asked.force * (limits.max_force / size) : asked.force;

    // Fade: no force until the hand is outside, and less and less while the server is silent.
    Guard after;
    after.now = asked.now;
    after.fault = before.fault;
    after.velocity = asked.velocity;
    double pressing = size;
    if (asked.surface) {
        pressing = std::max(pressing, asked.pressing);
    } else if (asked.had_patch) {
        pressing = std::numeric_limits<double>::infinity();
    }
    const bool silent = asked.silent || !asked.surface;
    after.quiet = pressing < limits.engage_below ? before.quiet + 1 : 0;
    const bool engaged =
        before.mode == Mode::Engaged ||
        (before.mode == Mode::Waiting && after.quiet >= limits.engage_periods && !silent);
    const bool up = engaged && !silent;
    after.mode = engaged ? Mode::Engaged : before.mode;
    if (engaged) after.fault.clear();
    double change = asked.counted / (up ? limits.engage_time : limits.fade_time);
    const double faded = std::min(size, limits.max_force);
    if (faded > 0.0) {
        change = std::min(change, std::min(FADE_RATE * asked.counted, asked.fade_limit) / faded);
    }
    after.scale = up ? std::min(1.0, before.scale + change) : std::max(0.0, before.scale - change);
    if (after.scale < 1.0) wanted = wanted * after.scale;

    // Rate: what the own motion does not explain is held to EXTERNAL_RATE, whatever a law says.
    double own = asked.own;
    if (asked.damping > 0.0 && asked.velocity != before.velocity) {
        own += asked.damping * norm(asked.velocity - before.velocity);
    }
    own = std::min(own, 2.0 * limits.max_force);
    double catch_up = before.catch_up, at_once = own;
    if (asked.dt > detail::STOOD_STILL) {
        catch_up = std::max(catch_up, own / asked.dt);
        at_once = 0.0;
    }
    if (catch_up > 0.0) {
        own += before.own;
        at_once += std::min(own - at_once, catch_up * asked.counted);
    } else {
        own += before.own * (1.0 - asked.counted / detail::FORGET_OWN);
        at_once = own;
    }
    own = std::min(own, 2.0 * limits.max_force);
    const double limit = std::min(limits.max_rate * asked.counted,
                                  at_once + detail::BACKSTOP * EXTERNAL_RATE * asked.counted);
    const Vec3 step = wanted - before.force;
    const double jump = norm(step);
    after.force = jump > limit ? before.force + step * (limit / jump) : wanted;
    if (own > limit) after.own = std::min(own - limit, norm(wanted - after.force));
    if (after.own > 0.0) after.catch_up = catch_up;
    return after;
}

// --------------------------------------------------------------------------------- passivity layer

/// Memory of the passivity layer (client/cohaptic_client/loop/passivity.py).
struct Passivity {
    double owed = 0.0;     ///< energy that the network made, and that was not damped out yet [J]
    double damping = 0.0;  ///< in use [N s/m]
    double stored = 0.0;   ///< in the law's spring, for the force that the hand is given [J]
};

namespace detail {

constexpr double FORGET = 5.0;      // s in which a resting hand takes out what is owed
constexpr double SLOW = 0.01;       // m/s; a slower hand has little energy
constexpr double RAMP = 0.05;       // s from no damping to the whole one: half a swing at 10 Hz
constexpr double STEP_RATE = 10.0;  // N/s by which a change of the damping moves the force

/// Damping [N s/m] and damped normal force [N] of one period in contact.
inline std::pair<double, double> dissipate(const Passivity &memory, double force, double speed_in,
                                           double dt, double max_damping, double limit) {
    if (force <= 0.0 || max_damping <= 0.0) return {0.0, force};
    const double speed = std::max(SLOW, std::fabs(speed_in));
    const double target =
        dt > 0.0 ? std::min(max_damping, memory.owed / (speed * speed * dt)) : 0.0;
    const double change = std::min({max_damping * dt / RAMP, STEP_RATE * dt / speed, limit});
    const double damping =
        std::min(std::max(target, memory.damping - change), memory.damping + change);
    // Damping never pulls a leaving hand back, and never stops an entering one like a wall.
    return {damping, force + std::min(force, std::max(-force, damping * speed_in))};
}

/// Energy that the spring of a law stores for the force that reaches the hand [J].
inline double given_energy(double stored, double ratio, double scale) {
    if (scale <= 0.0) return 0.0;
    ratio = std::min(ratio, scale);
    return stored * ratio * (2.0 - ratio / scale);
}

/// Energy that is owed after a period [J].
inline double observe(double owed, double work, double stored, double from_body, double dt) {
    return std::max(0.0, std::max(0.0, 1.0 - dt / FORGET) * owed + work + stored - from_body);
}

/// A unit vector at a right angle to a normal.
inline Vec3 tangent(const Vec3 &n) {
    const Vec3 out = std::fabs(n.x) < 0.7 ? Vec3{0.0, n.z, -n.y} : Vec3{-n.z, 0.0, n.x};
    return unit(out, {0.0, 0.0, 1.0});
}

/// Turns a normal towards another by at most `limit` [rad]; returns it, and the angle.
inline std::pair<Vec3, double> turn_back(const Vec3 &normal, const Vec3 &target, double limit) {
    const double along = dot(normal, target);
    const Vec3 aside = target - normal * (along / dot(normal, normal));
    const double size = norm(aside), angle = std::atan2(size, along);
    if (angle <= limit) return {target, angle};
    const Vec3 way = size > 1e-9 ? aside * (1.0 / size) : tangent(normal);
    return {unit(normal * std::cos(limit) + way * std::sin(limit), target), limit};
}

}  // namespace detail

// -------------------------------------------------------------------------------------- the loop

/// One hand's loop: patches and tips in, forces and samples out. It reads no clock and opens no
/// socket; `now` is a time on one clock of the program [s], and never goes back.
class Loop {
public:
    /// Throws SettingError, and ProtocolError for a period outside 0.005 to 0.1 s.
    Loop(double simulation_period, const Settings &settings)
        : Loop(simulation_period, settings, limits_of(simulation_period, settings)) {}
    Loop(double simulation_period, const Settings &settings, const Limits &limits)
        : period_(simulation_period), max_stiffness_(settings.max_stiffness),
          max_damping_(settings.max_damping), limits_(limits) {
        settings.check();
        detail::check_range("simulation_period", period_, wire::MIN_PERIOD, wire::MAX_PERIOD);
    }

    /// The limits of the guard for these settings, at a server with this period [s].
    static Limits limits_of(double simulation_period, const Settings &settings) {
        Limits limits;
        limits.max_force = settings.max_force;
        // Enough for the force that a tapping hand makes, at 0.5 m/s.
        limits.max_rate = std::max(1000.0, 0.5 * settings.max_stiffness);
        limits.max_speed = settings.max_speed;
        limits.stall = settings.stall;
        limits.engage_time = settings.engage_time;
        limits.latch = settings.latch;
        // Three ticks, at least 0.1 s: less is the jitter of a link.
        limits.silent_after = std::max(0.1, 3.0 * simulation_period);
        return limits;
    }

    /// Takes the frame of a patch that has come at `now`. Throws ProtocolError for a broken one,
    /// and the loop is as before.
    void give_patch(const std::uint8_t *data, std::size_t size, double now) {
        give_patch(Patch::decode(data, size), now);
    }
    void give_patch(const Bytes &frame, double now) {
        give_patch(frame.data(), frame.size(), now);
    }
    void give_patch(const Patch &patch, double now) {
        patch.check();
        const Patch *newest = newest_patch();
        // After a silence it may be of a server that has been restarted, and counts from 1.
        const bool silent = is_silent(now);
        if (leaving_ || (newest != nullptr && patch.tick <= newest->tick && !silent)) return;
        const double gap = now - arrived_;
        if (gap < std::numeric_limits<double>::infinity()) {
            const double kept = patience_ * std::exp(-gap / FORGET_GAPS);
            patience_ = gap > LONGEST_PATIENCE
                            ? kept  // an outage says nothing of the link's jitter
                            : std::min(LONGEST_PATIENCE, std::max(PATIENCE * gap, kept));
        }
        arrived_ = now;
        const bool follows = newest != nullptr && patch.tick > newest->tick &&
                             patch.t_server > newest->t_server &&
                             playout_.fits(now - patch.t_server);
        if (!follows) {  // also the first one, or one of another server's clock
            const double fraction = progress(now);
            playout_ = Playout::begun(now - patch.t_server + period_);
            coming_.clear();
            begin(patch, now, fraction);
            return;
        }
        if (!silent) playout_.measured(now - newest->t_server, now);
        coming_.push_back(patch);
        if (coming_.size() > MAX_COMING) coming_.pop_front();
        play(now);
    }

    /// One period, to be called once each millisecond: the force on the hand [N] for a tip [m] that
    /// moves with a velocity [m/s]. It is at most `max_force`, and makes no step.
    Vec3 step(const Vec3 &tip, const Vec3 &velocity, double now) {
        const double infinity = std::numeric_limits<double>::infinity();
        Asked asked;
        asked.now = now;
        asked.velocity = velocity;
        asked.dt = guard_.now ? std::max(0.0, now - *guard_.now) : 0.0;
        asked.counted = std::min(asked.dt, 2.0 * limits_.period);
        asked.trouble = trouble_of(tip, now);
        // The last place of a tip that is nowhere.
        const Vec3 place = norm(tip) <= wire::MAX_POSITION ? tip : probe_;
        const double counted = asked.counted;
        double budget = EXTERNAL_RATE * counted;

        // Surface: on its way from patch to patch.
        asked.silent = is_silent(now);
        play(now);
        const double fraction = progress(now);
        const std::optional<Sight> sight = shown(place, fraction);
        asked.had_patch = patch_.has_value();
        asked.surface = sight.has_value();
        asked.fade_limit = FADE_RATE * counted;
        asked.damping = passivity_.damping;
        const Vec3 moved = sight ? place - probe_ : Vec3{};
        double k_h = k_h_, depth = -infinity, moved_in = 0.0, normal_force = 0.0, damped = 0.0;
        Passivity passivity;
        Vec3 normal{0.0, 0.0, 1.0}, law_force;
        if (sight) {
            const double damping_limit = reserve(budget, asked);
            k_h = gain(budget, *sight, fraction, counted);
            normal = turn(budget, *sight, moved, k_h);
            moved_in = -dot(normal, moved);
            depth = held_depth(budget, sight->depth, moved_in, k_h);
            normal_force = damped = predictive_force(depth, k_h);
            law_force = asked.force = normal * normal_force;
            if (max_damping_ > 0.0 && sight_) {
                std::tie(passivity.damping, damped) =
                    detail::dissipate(passivity_, normal_force, -dot(normal, velocity), counted,
                                      max_damping_, damping_limit);
                if (damped != normal_force) asked.force = normal * damped;
            }
            asked.pressing = sight->depth / sight->c_ii;
            asked.own = own_change(moved, velocity, k_h, normal_force, damped, passivity.damping);
            asked.damping = std::max(asked.damping, passivity.damping);
            // Finite: patches and tip were checked, so only a fault of this code comes here.
            if (!is_finite(asked.force) || !is_finite(normal) || !std::isfinite(depth)) {
                return without_surface(asked, place);
            }
        }
        const Guard before = guard_;
        guard_ = guarded(guard_, asked, limits_);
        const double ratio = damped > 0.0 ? norm(guard_.force) / damped : guard_.scale;
        if (max_damping_ > 0.0 && sight && sight_) {
            // Account: the energy that is there, and that neither hand nor body has brought.
            const double whole = 0.5 * normal_force * depth;  // of the spring at its full force
            passivity.stored = detail::given_energy(whole, ratio, guard_.scale);
            const Vec3 carried = (sight_->own_force + sight->own_force) * 0.5;
            const double from_body =
                dot(carried, sight->normal) * (sight->depth - sight_->depth - moved_in);
            const double on_hand = 0.5 * dot(before.force + guard_.force, moved);
            const double gained = passivity.stored - passivity_.stored;
            passivity.owed =
                detail::observe(passivity_.owed, on_hand, gained, from_body, asked.dt);
        } else {
            passivity = Passivity{};
        }
        // Body: the law's force in the share that the hand was given; damping is the hand's affair.
        const double size = norm(law_force);
        double share = std::min(1.0, ratio);
        if (size * share > limits_.max_force) share = limits_.max_force / size;
        on_body_ = law_force * share;
        passivity_ = passivity;
        k_h_ = k_h;
        depth_ = depth;
        normal_ = normal;
        normal_force_ = normal_force;
        sight_ = sight;
        finish(place, now);
        if (const Patch *newest = newest_patch()) {
            playout_.advanced(std::min(asked.dt, Playout::LONGEST), now - newest->t_server);
        }
        return guard_.force;
    }

    /// The same for a device that states no velocity: it is that of the tip, filtered over 5 ms.
    Vec3 step(const Vec3 &tip, double now) {
        const double passed = guard_.now ? now - *guard_.now : 0.0;
        if (passed > 0.0 && is_finite(tip)) {
            velocity_ = lerp(velocity_, (tip - probe_) * (1.0 / passed),
                             passed / (passed + VELOCITY_FILTER));
        }
        const Vec3 velocity = is_finite(velocity_) ? velocity_ : Vec3{};
        if (!(norm(velocity) <= limits_.max_speed)) velocity_ = Vec3{};  // said once, and forgotten
        return step(tip, velocity, now);
    }

    /// The frame of a sample of the last period, to be sent once in a simulation period, with
    /// `now` of that period. `force` is what the body gets; none where `last` is true.
    Bytes sample(double now, bool last = false) {
        ContactSample sample;
        sample.seq = ++seq_;
        sample.tick = patch_ ? patch_->tick : 0;
        sample.t_client = now;
        sample.probe = probe_;
        sample.force = last ? Vec3{} : on_body_;
        // Of a device that gives all that the wire allows, 32 bits must not round to more.
        const double size = norm(sample.force), most = wire::MAX_FORCE * (1.0 - 1e-6);
        if (size > most) sample.force = sample.force * (most / size);
        return sample.encode();
    }

    /// From now on the server counts as silent: the force fades at 10 N/s, and stays away.
    void let_go() {
        leaving_ = true;
        arrived_ = -std::numeric_limits<double>::infinity();
    }
    /// The user has acknowledged a fault; without effect until the force is gone.
    void acknowledge() {
        if (guard_.mode != Guard::Mode::Fault || guard_.force != Vec3{}) return;
        Guard after;
        after.now = guard_.now;
        after.fault = guard_.fault;
        guard_ = after;
    }

    const Guard &guard() const { return guard_; }          ///< force, fault, share of the force
    const Passivity &passivity() const { return passivity_; }
    const Playout &playout() const { return playout_; }
    Vec3 on_body() const { return on_body_; }              ///< whose opposite the body gets [N]
    double depth() const { return depth_; }                ///< below the free surface [m]
    Vec3 normal() const { return normal_; }
    double k_h() const { return k_h_; }                    ///< gain in use [N/m]; 0 before a patch
    double patience() const { return patience_; }          ///< for a silent server [s]
    bool free() const { return guard_.force == Vec3{}; }   ///< whether there is no force
    /// Stiffness of the object at the contact [N/m]; 0 before the first patch.
    double k_o() const { return sight_ ? 1.0 / sight_->c_ii : 0.0; }
    /// Whether no patch has come for 0.1 s, three ticks, or twice the longest gap of late.
    bool is_silent(double now) const {
        return now - arrived_ > std::max(limits_.silent_after, patience_);
    }

private:
    static constexpr double PATIENCE = 2.0;          // of the longest gap: less is jitter
    static constexpr double LONGEST_PATIENCE = 1.0;  // s; a worse link is of no use for touching
    static constexpr double FORGET_GAPS = 30.0;      // s
    static constexpr std::size_t MAX_COMING = 32;    // patches that wait
    static constexpr double AT_ONCE = 1e-6;          // s; rounding of times
    static constexpr double GAIN_RATE = 10.0;        // 1/s: 1 % of a gain in a millisecond
    static constexpr double SOFT = 1.0;              // N/m; a gain of 0 would stay 0
    static constexpr double MAX_CHANGE = 2.0;        // of c_ii within one patch
    static constexpr double AS_STIFF = 1.0 - 1e-5;   // K_h C_ii of 1 / c_ii in 32 bits
    static constexpr double CUT = 0.95;              // share of the force; more damping was cut
    static constexpr double VELOCITY_FILTER = 0.005;  // s

    double period_, max_stiffness_, max_damping_;
    Limits limits_;
    Guard guard_;
    Passivity passivity_;
    Playout playout_;
    std::optional<Patch> patch_;          // shown, or moved to
    std::optional<Patch> surface_;        // the same; none after a fault of the law
    std::optional<Patch> before_;         // from which the move began
    std::optional<Sight> offset_;         // what was shown then, less `before_`
    std::deque<Patch> coming_;            // whose time is still to come
    std::optional<Sight> sight_;          // of the last period
    double arrived_ = -std::numeric_limits<double>::infinity();  // of the newest patch [s]
    double patience_ = 0.0, k_h_ = 0.0, k_h_before_ = 0.0, normal_force_ = 0.0;
    double depth_ = -std::numeric_limits<double>::infinity();
    double move_begins_ = 0.0, move_ends_ = 0.0;  // playing times [s]
    Vec3 probe_, normal_{0.0, 0.0, 1.0}, on_body_, velocity_;
    std::uint32_t seq_ = 0;
    bool leaving_ = false;

    const Patch *newest_patch() const {
        return coming_.empty() ? (patch_ ? &*patch_ : nullptr) : &coming_.back();
    }

    /// Reach: a tip that is nowhere, or jumps faster than a hand, is a broken sensor.
    std::string trouble_of(const Vec3 &tip, double now) const {
        using detail::text_of;
        if (!(norm(tip) <= wire::MAX_POSITION)) {
            return "the device is at " + text_of(norm(tip)) + " m, beyond " +
                   text_of(wire::MAX_POSITION) + " m";
        }
        if (!guard_.now) return "";
        const double limit =
            limits_.max_speed * (std::max(0.0, now - *guard_.now) + limits_.stale);
        const Vec3 way = tip - probe_;
        if (dot(way, way) <= limit * limit) return "";
        return "the device jumped by " + text_of(1e3 * norm(way), 3) + " mm, faster than " +
               text_of(limits_.max_speed) + " m/s";
    }

    /// Share of the move to the newest shown patch that is complete, 0 to 1.
    double progress(double now) const {
        const double way = move_ends_ - move_begins_;
        const double done = way > 0.0 ? (now - playout_.behind - move_begins_) / way : 1.0;
        return done < 1.0 ? std::max(0.0, done) : 1.0;
    }
    /// The shown surface at a tip; none before the first patch.
    std::optional<Sight> shown(const Vec3 &tip, double fraction) const {
        if (!surface_) return std::nullopt;
        const Sight sight = look(*surface_, tip);
        if (fraction >= 1.0 || !before_) return sight;
        const Sight old = look(*before_, tip);
        return blend(offset_ ? shift(old, *offset_) : old, sight, fraction);
    }
    /// Begins the move to the next patch if its time has come. Each is shown whole at its own
    /// playing time; several that are late are left out but for the newest of them.
    void play(double now) {
        const double playing = now - playout_.behind;
        if (coming_.empty() || playing < move_ends_ - AT_ONCE) return;
        std::size_t first = 0;
        while (first + 1 < coming_.size() && playing >= coming_[first + 1].t_server - period_) {
            ++first;
        }
        if (playing < patch_->t_server - AT_ONCE) return;
        const Patch next = coming_[first];
        coming_.erase(coming_.begin(), coming_.begin() + static_cast<std::ptrdiff_t>(first) + 1);
        begin(next, now, 1.0);
    }
    /// Begins the move to a patch from what is shown now.
    void begin(const Patch &patch, double now, double fraction) {
        double playing = now - playout_.behind;
        const double since = playing - move_ends_;
        if (0.0 <= since && since <= limits_.period) playing = move_ends_;  // between two periods
        const std::optional<Sight> at_arrival = shown(probe_, fraction);
        offset_.reset();
        if (surface_ && at_arrival) offset_ = difference(*at_arrival, look(*surface_, probe_));
        // A patch that comes late is caught up with in half a period at least; stamps far apart
        // must not make a move that never ends.
        const double way = std::max(
            0.5 * period_, std::min(Playout::LONGEST + period_, patch.t_server - playing));
        before_ = surface_;
        if (!surface_) k_h_ = std::min(patch.k_h, max_stiffness_);
        patch_ = surface_ = patch;
        k_h_before_ = k_h_;
        move_begins_ = playing;
        move_ends_ = playing + way;
    }

    /// Reserve: parts of the budget for fades, and for the damping of a slow hand [N s/m].
    double reserve(double &budget, Asked &asked) const {
        if (asked.silent || guard_.scale < 1.0) asked.fade_limit = take(budget, asked.fade_limit);
        const double speed = norm(asked.velocity);
        if (0.0 < speed && speed <= detail::SLOW &&
            (passivity_.owed > 0.0 || passivity_.damping > 0.0)) {
            const double whole = speed * max_damping_ * asked.counted / detail::RAMP;
            const double granted = take(budget, whole);
            if (granted < whole) return granted / speed;
        }
        return std::numeric_limits<double>::infinity();
    }
    /// Gain: follows the object's stiffness slowly.
    double gain(double &budget, const Sight &sight, double fraction, double counted) const {
        const Patch &patch = *patch_;
        const double c_ii =
            std::max({wire::MIN_COMPLIANCE, patch.c_ii / MAX_CHANGE,
                      std::min(patch.c_ii * MAX_CHANGE, sight.c_ii)});
        // A gain that the server has made lower than the object's is a limit, too.
        const double limit = patch.k_h * patch.c_ii < AS_STIFF
                                 ? std::min(max_stiffness_, patch.k_h) : max_stiffness_;
        const double newest = std::min(1.0 / c_ii, limit);
        const double wanted = k_h_before_ + fraction * (newest - k_h_before_);
        double after = k_h_;
        if (wanted != k_h_) {
            const double rate = normal_force_ > 0.0
                                    ? std::min(GAIN_RATE, 0.5 * EXTERNAL_RATE / normal_force_)
                                    : GAIN_RATE;
            const double factor = std::exp(std::min(1.0, rate * counted));
            after = std::min(std::max(wanted, k_h_ / factor), std::max(k_h_, SOFT) * factor);
        }
        const double change = std::fabs(after - k_h_) * std::max(0.0, depth_);
        const double granted = take(budget, change);
        return granted < change ? k_h_ + (after - k_h_) * granted / change : after;
    }
    /// Turn: a surface that turns may turn the force with half of what is left.
    Vec3 turn(double &budget, const Sight &sight, const Vec3 &moved, double k_h) const {
        if (normal_force_ <= 0.0 || sight.normal == normal_) return sight.normal;
        if (sight.depth <= 0.0) return normal_;  // a vanishing force need not turn any more
        const double force = std::min(normal_force_, limits_.max_force);
        const double own = k_h * norm(moved - normal_ * dot(normal_, moved));
        const auto turned =
            detail::turn_back(normal_, sight.normal, (0.5 * budget + own) / force);
        take(budget, std::max(0.0, turned.second * force - own));
        return turned.first;
    }
    /// Depth: moves with the hand, and with the surface as the rest of the budget allows.
    double held_depth(double budget, double target, double moved_in, double k_h) const {
        const double own = depth_ + moved_in;
        if (own <= 0.0 && target <= 0.0) return target;  // there is no force to change
        // A force that the hand does not get may change at once.
        const bool given = sight_ && guard_.scale > 0.0;
        const double limit =
            given ? budget / std::max(k_h, SOFT) : std::numeric_limits<double>::infinity();
        const double start = std::max(0.0, own);
        return std::min(std::max(target, start - limit), start + limit);
    }
    /// Largest change of the force that the hand's own motion explains [N].
    double own_change(const Vec3 &moved, const Vec3 &velocity, double k_h, double law_force,
                      double damped, double damping) const {
        const double way = norm(moved);
        if (way == 0.0) return 0.0;
        double own = std::max(k_h_, k_h) * way;
        const double speed = norm(velocity);
        if (damping > 0.0 && law_force > 0.0 && speed > detail::SLOW) {
            if (std::fabs(damped - law_force) >= CUT * law_force) own *= 2.0;
            own += speed * std::fabs(damping - passivity_.damping);
        }
        return own;
    }
    /// A period after a fault of the law: the force is released, and no surface used until the
    /// next patch.
    Vec3 without_surface(Asked asked, const Vec3 &place) {
        if (asked.trouble.empty()) asked.trouble = "the law failed: its force is no number";
        asked.force = Vec3{};
        guard_ = guarded(guard_, asked, limits_);
        surface_.reset();
        before_.reset();
        offset_.reset();
        sight_.reset();
        k_h_ = k_h_before_ = normal_force_ = 0.0;
        depth_ = -std::numeric_limits<double>::infinity();
        normal_ = {0.0, 0.0, 1.0};
        passivity_ = Passivity{};
        on_body_ = Vec3{};
        finish(place, asked.now);
        return guard_.force;
    }
    void finish(const Vec3 &place, double now) {
        probe_ = place;
        arrived_ = std::min(arrived_, now);  // a clock that goes back makes no patch younger
    }
    static double take(double &budget, double wanted) {
        const double granted = std::min(wanted, budget);
        budget -= granted;
        return granted;
    }
};

// ------------------------------------------------------------------------------------- websocket

namespace detail {

/// SHA-1 (RFC 3174), which the handshake of a websocket needs: no secret depends on it.
inline std::array<std::uint8_t, 20> sha1(const std::string &text) {
    std::array<std::uint32_t, 5> h{0x67452301u, 0xefcdab89u, 0x98badcfeu, 0x10325476u, 0xc3d2e1f0u};
    std::string padded = text + '\x80';
    while (padded.size() % 64 != 56) padded += '\0';
    const std::uint64_t bits = 8 * static_cast<std::uint64_t>(text.size());
    for (int i = 7; i >= 0; --i) padded += static_cast<char>(bits >> (8 * i) & 0xffu);
    const auto turned = [](std::uint32_t v, int n) { return v << n | v >> (32 - n); };
    for (std::size_t block = 0; block < padded.size(); block += 64) {
        std::array<std::uint32_t, 80> w{};
        for (std::size_t i = 0; i < 64; ++i) {
            w[i / 4] = w[i / 4] << 8 | static_cast<unsigned char>(padded[block + i]);
        }
        for (std::size_t i = 16; i < 80; ++i) {
            w[i] = turned(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
        }
        std::array<std::uint32_t, 5> v = h;
        for (std::size_t i = 0; i < 80; ++i) {
            const std::uint32_t f = i < 20   ? (v[1] & v[2]) | (~v[1] & v[3])
                                    : i < 40 ? v[1] ^ v[2] ^ v[3]
                                    : i < 60 ? (v[1] & v[2]) | (v[1] & v[3]) | (v[2] & v[3])
                                             : v[1] ^ v[2] ^ v[3];
            const std::uint32_t k = i < 20 ? 0x5a827999u : i < 40 ? 0x6ed9eba1u
                                    : i < 60 ? 0x8f1bbcdcu : 0xca62c1d6u;
            const std::uint32_t next = turned(v[0], 5) + f + v[4] + k + w[i];
            v = {next, v[0], turned(v[1], 30), v[2], v[3]};
        }
        for (std::size_t i = 0; i < 5; ++i) h[i] += v[i];
    }
    std::array<std::uint8_t, 20> digest{};
    for (std::size_t i = 0; i < 20; ++i) {
        digest[i] = static_cast<std::uint8_t>(h[i / 4] >> (24 - 8 * (i % 4)) & 0xffu);
    }
    return digest;
}

template <class Container>
std::string base64(const Container &data) {
    static constexpr char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < data.size(); i += 3) {
        std::uint32_t three = static_cast<std::uint32_t>(data[i]) << 16;
        if (i + 1 < data.size()) three |= static_cast<std::uint32_t>(data[i + 1]) << 8;
        if (i + 2 < data.size()) three |= data[i + 2];
        out += letters[three >> 18];
        out += letters[three >> 12 & 63];
        out += i + 1 < data.size() ? letters[three >> 6 & 63] : '=';
        out += i + 2 < data.size() ? letters[three & 63] : '=';
    }
    return out;
}

inline std::string lower(std::string text) {
    for (char &c : text) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return text;
}

}  // namespace detail

/// A ws: address. Throws SettingError for any other, and says of wss: that it is not spoken.
struct Address {
    std::string host, port = "80", path = "/";

    static Address read(const std::string &url) {
        const auto no = [&url](const char *limit) -> SettingError {
            return SettingError("address is '" + detail::one_line(url) + "'; it must be " + limit);
        };
        for (const char c : url) {
            if (c <= ' ' || c == 0x7f) throw no("without blanks and characters beyond ASCII");
        }
        if (url.compare(0, 6, "wss://") == 0) {
            throw no("of ws://, since this client has no TLS; put a TLS tunnel before it");
        }
        if (url.compare(0, 5, "ws://") != 0) throw no("of ws://HOST:PORT");
        if (url.find('#') != std::string::npos) {
            throw no("without '#': what stands behind it is a token for `Settings::token`");
        }
        Address address;
        std::string rest = url.substr(5);
        const std::size_t slash = rest.find_first_of("/?");
        if (slash != std::string::npos) {
            address.path = rest[slash] == '?' ? "/" + rest.substr(slash) : rest.substr(slash);
            rest.resize(slash);
        }
        const std::size_t bracket = rest.rfind(']');
        const std::size_t colon = rest.rfind(':');
        if (colon != std::string::npos && (bracket == std::string::npos || colon > bracket)) {
            address.port = rest.substr(colon + 1);
            rest.resize(colon);
        }
        const bool six = rest.size() > 2 && rest.front() == '[' && rest.back() == ']';
        address.host = six ? rest.substr(1, rest.size() - 2) : rest;
        const bool digits = !address.port.empty() && address.port.size() <= 5 &&
                            address.port.find_first_not_of("0123456789") == std::string::npos;
        if (!digits || std::stoi(address.port) > 65535) throw no("with a port from 0 to 65535");
        if (address.host.empty() || address.host.find_first_of("@[]") != std::string::npos ||
            (!six && address.host.find(':') != std::string::npos)) {
            throw no("of ws://HOST:PORT");
        }
        return address;
    }
};

/// A message or a control frame of a websocket.
struct Frame {
    enum class Kind : unsigned { Text = 1, Binary = 2, Close = 8, Ping = 9, Pong = 10 };
    Kind kind = Kind::Text;
    std::string data;
};

/// Cuts a server's stream of bytes into frames (RFC 6455). Bounded: it keeps one incomplete frame.
class FrameReader {
public:
    void feed(const char *data, std::size_t size) { kept_.append(data, size); }

    /// The next whole frame, or none yet. Throws ProtocolError for what RFC 6455 or
    /// docs/protocol.md forbids: a masked or compressed frame, a fragment, one that is too long.
    std::optional<Frame> next() {
        const auto byte = [this](std::size_t i) -> std::uint64_t {
            return static_cast<unsigned char>(kept_[at_ + i]);
        };
        const std::size_t here = kept_.size() - at_;
        if (here < 2) return nothing();
        const auto first = static_cast<unsigned>(byte(0)), second = static_cast<unsigned>(byte(1));
        const unsigned code = first & 0x0fu;
        using detail::text_of;
        if (first & 0x70u) detail::refuse("reserved bits of a frame", text_of(first >> 4 & 7), "0");
        if (code != 1 && code != 2 && (code < 8 || code > 10)) {
            detail::refuse("opcode of a frame", text_of(code), "1, 2, 8, 9 or 10");
        }
        if (!(first & 0x80u)) detail::refuse("frame", "a fragment", "a whole message");
        if (second & 0x80u) detail::refuse("frame of the server", "masked", "not masked");
        std::size_t head = 2;
        std::uint64_t size = second & 0x7fu;
        if (size >= 126) {
            const std::size_t more = size == 126 ? 2 : 8;
            if (here < 2 + more) return nothing();
            head += more;
            size = 0;
            for (std::size_t i = 0; i < more; ++i) size = size << 8 | byte(2 + i);
        }
        const double longest = code >= 8 ? 125.0 : code == 2 ? wire::MAX_FRAME_BYTES
                                                             : 4.0 * wire::MAX_TEXT;
        detail::check_range("bytes of a frame", static_cast<double>(size), 0.0, longest);
        if (here - head < size) return nothing();
        Frame frame;
        frame.kind = static_cast<Frame::Kind>(code);
        frame.data = kept_.substr(at_ + head, static_cast<std::size_t>(size));
        at_ += head + static_cast<std::size_t>(size);
        return frame;
    }

private:
    std::string kept_;
    std::size_t at_ = 0;

    std::optional<Frame> nothing() {
        kept_.erase(0, at_);
        at_ = 0;
        return std::nullopt;
    }
};

/// The bytes of a client's frame, masked with four unpredictable bytes (RFC 6455, 5.3).
inline std::string make_frame(Frame::Kind kind, const std::string &data, std::uint32_t key) {
    std::string out(1, static_cast<char>(0x80u | static_cast<unsigned>(kind)));
    const std::size_t size = data.size();
    const std::size_t more = size < 126 ? 0 : size < 65536 ? 2 : 8;
    out += static_cast<char>(0x80u | (more == 0 ? size : more == 2 ? 126u : 127u));
    for (std::size_t i = more; i-- > 0;) {
        out += static_cast<char>(static_cast<std::uint64_t>(size) >> (8 * i) & 0xffu);
    }
    for (std::size_t i = 0; i < 4; ++i) out += static_cast<char>(key >> (8 * i) & 0xffu);
    for (std::size_t i = 0; i < size; ++i) {
        const std::uint32_t mask = key >> (8 * (i % 4)) & 0xffu;
        out += static_cast<char>(static_cast<unsigned char>(data[i]) ^ mask);
    }
    return out;
}

// ---------------------------------------------------------------------------------------- socket

namespace detail {

#ifdef _WIN32
using Handle = SOCKET;
constexpr Handle NO_SOCKET = INVALID_SOCKET;
inline int last_error() { return WSAGetLastError(); }
inline bool would_wait(int error) { return error == WSAEWOULDBLOCK || error == WSAEINPROGRESS; }
inline bool interrupted(int error) { return error == WSAEINTR; }
inline std::string words_of(int error) { return "error " + text_of(error); }
inline void close_handle(Handle handle) { closesocket(handle); }
inline bool never_waits(Handle handle) {
    u_long on = 1;
    return ioctlsocket(handle, FIONBIO, &on) == 0;
}
inline int poll_one(Handle handle, short events, int milliseconds) {
    WSAPOLLFD one{handle, events, 0};
    return WSAPoll(&one, 1, milliseconds);
}
/// Winsock, for as long as a socket lives.
struct System {
    System() {
        WSADATA data;
        const int error = WSAStartup(MAKEWORD(2, 2), &data);
        if (error != 0) throw ConnectionError("Winsock does not start: " + words_of(error));
    }
    ~System() { WSACleanup(); }
    System(const System &) = delete;
    System &operator=(const System &) = delete;
};
#else
using Handle = int;
constexpr Handle NO_SOCKET = -1;
inline int last_error() { return errno; }
inline bool would_wait(int error) {
    return error == EAGAIN || error == EWOULDBLOCK || error == EINPROGRESS;
}
inline bool interrupted(int error) { return error == EINTR; }
inline std::string words_of(int error) { return std::strerror(error); }
inline void close_handle(Handle handle) { ::close(handle); }
inline bool never_waits(Handle handle) {
    const int flags = fcntl(handle, F_GETFL, 0);
    return flags >= 0 && fcntl(handle, F_SETFL, flags | O_NONBLOCK) == 0;
}
inline int poll_one(Handle handle, short events, int milliseconds) {
    pollfd one{handle, events, 0};
    return ::poll(&one, 1, milliseconds);
}
#endif

#ifdef MSG_NOSIGNAL
constexpr int SEND_FLAGS = MSG_NOSIGNAL;  // a closed connection is an error, and no signal
#else
constexpr int SEND_FLAGS = 0;
#endif

/// A TCP connection that never waits, but where a time is given.
class Socket {
public:
    Socket() = default;
    ~Socket() { close(); }
    Socket(const Socket &) = delete;
    Socket &operator=(const Socket &) = delete;

    bool is_open() const { return handle_ != NO_SOCKET; }
    void close() {
        if (is_open()) close_handle(handle_);
        handle_ = NO_SOCKET;
    }
    /// Connects within a time [s]; throws ConnectionError.
    void connect(const Address &address, double patience) {
        addrinfo wanted{};
        wanted.ai_family = AF_UNSPEC;
        wanted.ai_socktype = SOCK_STREAM;
        addrinfo *found = nullptr;
        const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &wanted, &found);
        const std::string where = address.host + " port " + address.port;
        if (error != 0) throw ConnectionError(where + " is not found");
        std::string why = "no address";
        for (const addrinfo *one = found; one != nullptr && !is_open(); one = one->ai_next) {
            why = try_one(*one, patience);
        }
        freeaddrinfo(found);
        if (!is_open()) throw ConnectionError("no server answers at " + where + ": " + why);
    }
    /// Waits until there is something to read, or for a time [s]; whether there is.
    bool wait(double seconds) const {
        return poll_one(handle_, POLLIN, static_cast<int>(1e3 * std::max(0.0, seconds)) + 1) > 0;
    }
    /// Reads what is there, at most `size` bytes; 0 if there is nothing. Throws ConnectionError.
    std::size_t read(char *into, std::size_t size) {
        for (;;) {
#ifdef _WIN32
            const int got = ::recv(handle_, into, static_cast<int>(size), 0);
#else
            const ssize_t got = ::recv(handle_, into, size, 0);
#endif
            if (got > 0) return static_cast<std::size_t>(got);
            if (got == 0) throw ConnectionError("the server closed the connection");
            const int error = last_error();
            if (would_wait(error)) return 0;
            if (!interrupted(error)) lost(error);
        }
    }
    /// Writes as much as the system takes now; returns how many bytes. Throws ConnectionError.
    std::size_t write(const char *data, std::size_t size) {
        for (;;) {
#ifdef _WIN32
            const int put = ::send(handle_, data, static_cast<int>(size), SEND_FLAGS);
#else
            const ssize_t put = ::send(handle_, data, size, SEND_FLAGS);
#endif
            if (put >= 0) return static_cast<std::size_t>(put);
            const int error = last_error();
            if (would_wait(error)) return 0;
            if (!interrupted(error)) lost(error);
        }
    }

private:
#ifdef _WIN32
    System system_;
#endif
    Handle handle_ = NO_SOCKET;

    [[noreturn]] static void lost(int error) {
        throw ConnectionError("the connection was lost: " + words_of(error));
    }
    /// Tries one address; why it failed, or nothing.
    std::string try_one(const addrinfo &one, double patience) {
        handle_ = ::socket(one.ai_family, one.ai_socktype, one.ai_protocol);
        if (!is_open()) return words_of(last_error());
        int on = 1, error = 0;
        // A sample must not wait for the acknowledgement of the one before.
        setsockopt(handle_, IPPROTO_TCP, TCP_NODELAY, reinterpret_cast<const char *>(&on),
                   sizeof on);
#ifdef SO_NOSIGPIPE
        setsockopt(handle_, SOL_SOCKET, SO_NOSIGPIPE, &on, sizeof on);
#endif
        if (!never_waits(handle_)) {
            error = last_error();
        } else if (::connect(handle_, one.ai_addr, static_cast<socklen_t>(one.ai_addrlen)) != 0) {
            error = last_error();
            if (would_wait(error)) {
                socklen_t size = sizeof error;
                const int came = poll_one(handle_, POLLOUT, static_cast<int>(1e3 * patience));
                if (came <= 0) {
                    close();
                    return "no answer within " + text_of(patience) + " s";
                }
                getsockopt(handle_, SOL_SOCKET, SO_ERROR, reinterpret_cast<char *>(&error), &size);
            }
        }
        if (error == 0) return "";
        close();
        return words_of(error);
    }
};

/// A time on a clock that never goes back [s].
inline double seconds() {
    const auto passed = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(passed).count();
}

}  // namespace detail

/// A websocket to a server that may be read and written without waiting.
class WebSocket {
public:
    /// Connects within a time [s]. Throws SettingError, ConnectionError or ProtocolError.
    WebSocket(const std::string &url, double patience) {
        const Address address = Address::read(url);
        const double until = detail::seconds() + patience;
        socket_.connect(address, patience);
        std::array<std::uint8_t, 16> nonce{};
        for (std::uint8_t &byte : nonce) byte = static_cast<std::uint8_t>(random_() & 0xffu);
        const std::string key = detail::base64(nonce);
        const bool six = address.host.find(':') != std::string::npos;
        const std::string host = six ? '[' + address.host + ']' : address.host;
        unsent_ = "GET " + address.path + " HTTP/1.1\r\nHost: " + host + ':' + address.port +
                  "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: " + key +
                  "\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: " +
                  wire::SUBPROTOCOL + "\r\n\r\n";
        flush();
        std::string answer;
        std::size_t end = std::string::npos;
        while (end == std::string::npos) {
            if (answer.size() > MAX_ANSWER) {
                detail::refuse("bytes of the answer to the handshake",
                               detail::text_of(answer.size()),
                               "at most " + detail::text_of(MAX_ANSWER));
            }
            if (!socket_.wait(until - detail::seconds()) && detail::seconds() > until) {
                throw ConnectionError("the server does not answer the handshake within " +
                                      detail::text_of(patience) + " s");
            }
            char buffer[2048];
            answer.append(buffer, socket_.read(buffer, sizeof buffer));
            end = answer.find("\r\n\r\n");
        }
        check_answer(answer.substr(0, end + 2), answer.substr(end + 4), key);
        reader_.feed(answer.data() + end + 4, answer.size() - end - 4);
    }

    bool is_open() const { return socket_.is_open(); }
    /// Whether bytes of earlier messages still wait.
    bool is_behind() const { return !unsent_.empty(); }

    /// Sends a message as far as the system takes it now; the rest waits for `flush`. Throws
    /// ConnectionError, also where too much waits.
    void send(Frame::Kind kind, const std::string &data) {
        unsent_ += make_frame(kind, data, random_());
        flush();
        if (unsent_.size() > MAX_UNSENT) {
            throw ConnectionError("the server takes nothing: " +
                                  detail::text_of(unsent_.size()) +
                                  " bytes wait, above " + detail::text_of(MAX_UNSENT));
        }
    }
    void flush() {
        if (!unsent_.empty()) unsent_.erase(0, socket_.write(unsent_.data(), unsent_.size()));
    }
    /// The next message that has come, or none; answers pings, and never waits. Throws
    /// ConnectionError with the server's reason once it has closed, or ProtocolError.
    std::optional<Frame> receive() {
        for (int turn = 0; turn < MAX_TURNS; ++turn) {
            std::optional<Frame> frame = reader_.next();
            if (!frame) {
                char buffer[4096];
                const std::size_t size = socket_.read(buffer, sizeof buffer);
                if (size == 0) return std::nullopt;
                reader_.feed(buffer, size);
            } else if (frame->kind == Frame::Kind::Ping) {
                send(Frame::Kind::Pong, frame->data);
            } else if (frame->kind == Frame::Kind::Close) {
                send(Frame::Kind::Close, frame->data.substr(0, 2));
                const std::string &data = frame->data;
                if (data.size() < 2) throw ConnectionError("the server closed the connection");
                const unsigned code = static_cast<unsigned char>(data[0]) * 256u +
                                      static_cast<unsigned char>(data[1]);
                throw ConnectionError("the server closed with " + detail::text_of(code) + ": " +
                                      detail::one_line(data.substr(2)));
            } else if (frame->kind != Frame::Kind::Pong) {
                return frame;
            }
        }
        return std::nullopt;
    }
    /// Waits until something has come, or for a time [s].
    void wait(double seconds) const { socket_.wait(seconds); }
    /// Closes with 1000, and waits at most a time [s] for the server to do the same.
    void close(double patience) {
        if (!is_open()) return;
        try {
            send(Frame::Kind::Close, std::string("\x03\xe8", 2));
            const double until = detail::seconds() + patience;
            while (detail::seconds() < until) {
                flush();
                wait(std::min(0.01, until - detail::seconds()));
                receive();
            }
        } catch (const Error &) {  // the answer, or a connection that is gone already
        }
        socket_.close();
    }
    void abandon() { socket_.close(); }

private:
    static constexpr std::size_t MAX_ANSWER = 16384;  // bytes; our own server's has 200
    static constexpr std::size_t MAX_UNSENT = 65536;  // bytes; pongs and a few samples
    static constexpr int MAX_TURNS = 32;  // reads and pings in one call: a flood holds nobody up

    detail::Socket socket_;
    FrameReader reader_;
    std::string unsent_;
    std::random_device random_;

    static void check_answer(const std::string &head, const std::string &body,
                             const std::string &key) {
        const std::string status = head.substr(0, head.find("\r\n"));
        if (status.compare(0, 12, "HTTP/1.1 101") != 0) {
            const std::string why = body.empty() ? "" : " and says: " + detail::one_line(body);
            throw ConnectionError("the server answers '" + detail::one_line(status) +
                                  "', no websocket of cohaptic" + why);
        }
        const auto accepted = detail::base64(
            detail::sha1(key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"));  // RFC 6455, 1.3
        const auto value = [&head](const std::string &name) {
            const std::size_t at = detail::lower(head).find("\r\n" + name + ":");
            if (at == std::string::npos) return std::string();
            const std::size_t begin = head.find_first_not_of(" \t", at + name.size() + 3);
            return head.substr(begin, head.find("\r\n", begin) - begin);
        };
        const std::string found = value("sec-websocket-accept"), spoken =
            value("sec-websocket-protocol");
        if (found != accepted) detail::refuse("Sec-WebSocket-Accept", found, accepted);
        if (spoken != wire::SUBPROTOCOL) {
            detail::refuse("Sec-WebSocket-Protocol", spoken, wire::SUBPROTOCOL);
        }
        const std::string extensions = value("sec-websocket-extensions");
        if (!extensions.empty()) detail::refuse("Sec-WebSocket-Extensions", extensions, "none");
    }
};

// ------------------------------------------------------------------------------------------ hand

/// A hand at a server: `Loop` at a `WebSocket`, on the clock of this machine.
///
/// The constructor waits for the welcome; `step` never waits. Once the connection is lost, or the
/// server has broken the protocol, `step` goes on and the force fades; it throws the error when
/// nothing is left of the force, so that no exception leaves a motor with its last command.
class Hand {
public:
    /// Joins. Throws SettingError, ConnectionError, ProtocolError or Refused.
    Hand(const std::string &url, const std::string &name, const Settings &settings = {})
        : socket_((settings.check(), url), settings.patience) {
        socket_.send(Frame::Kind::Text, hello(name, settings));
        const double until = detail::seconds() + settings.patience;
        while (!loop_) {
            if (detail::seconds() > until) {
                throw ConnectionError("the server has not welcomed this hand within " +
                                      detail::text_of(settings.patience) + " s");
            }
            const std::optional<Frame> frame = socket_.receive();
            if (!frame) {
                socket_.wait(std::min(0.05, until - detail::seconds()));
                continue;
            }
            if (frame->kind != Frame::Kind::Text) {
                detail::refuse("first message", "a binary frame", "welcome or error");
            }
            const Json message = Json::parse(frame->data);
            const std::string &type = message.text_at("type");
            if (type == "error") throw refusal(message);
            if (type != "welcome") detail::refuse("first message", type, "welcome or error");
            welcome_ = Welcome::read(message);
            loop_.emplace(welcome_.simulation_period, settings);
            pacer_ = Pacer{welcome_.simulation_period, detail::seconds()};
        }
    }
    /// Leaves at once, with a last sample without force; `let_go` comes before it, for the hand.
    ~Hand() { close(); }
    Hand(const Hand &) = delete;
    Hand &operator=(const Hand &) = delete;

    /// One period, once each millisecond: the force on the hand [N] for a tip [m] that moves with a
    /// velocity [m/s]. Throws what ended the connection, once the force has faded.
    Vec3 step(const Vec3 &tip, const Vec3 &velocity) {
        const double now = begin();
        return end(loop_->step(tip, velocity, now), now);
    }
    /// The same for a device that states no velocity.
    Vec3 step(const Vec3 &tip) {
        const double now = begin();
        return end(loop_->step(tip, now), now);
    }

    /// From now on the force fades; go on with `step` until `free`.
    void let_go() { loop_->let_go(); }
    bool free() const { return loop_->free(); }
    /// Sends a last sample without force and the goodbye, and closes within a second.
    void close() noexcept {
        if (!socket_.is_open()) return;
        try {
            if (stepped_) send_sample(detail::seconds(), true);
            socket_.send(Frame::Kind::Text, "{\"type\":\"bye\"}");
            socket_.close(1.0);
        } catch (const std::exception &) {  // there is nobody to say goodbye to
            socket_.abandon();
        }
    }

    /// Whether messages go to and fro; while not, the force fades.
    bool connected() const { return socket_.is_open() && why_.empty(); }
    /// Whether an administrator keeps this hand's force from the body.
    bool restrained() const { return restrained_; }
    /// Whether the server records the session.
    bool recorded() const { return recorded_; }
    const Welcome &welcome() const { return welcome_; }
    Loop &loop() { return *loop_; }
    double k_o() const { return loop_->k_o(); }      ///< of the object at the contact [N/m]
    double depth() const { return loop_->depth(); }  ///< below the free surface [m]

private:
    static constexpr int MAX_HEARD = 32;  // messages in a period; the rest waits for the next one

    WebSocket socket_;
    Welcome welcome_;
    std::optional<Loop> loop_;
    Pacer pacer_;
    std::string why_;  // the connection has ended; empty while it has not
    bool broken_ = false, restrained_ = false, recorded_ = false, stepped_ = false;
    std::optional<Refused> refused_;

    static Refused refusal(const Json &message) {
        const auto code = message.integer_at("code", 0.0, 65535.0);
        const Json *field = message.find("field");
        return Refused(static_cast<int>(code), field != nullptr ? field->text : std::string(),
                       detail::one_line(message.text_at("message")));
    }

    /// What has come meanwhile goes to the loop; the time of this period.
    double begin() {
        const double now = detail::seconds();
        if (!connected()) return now;
        try {
            socket_.flush();
            for (int heard = 0; heard < MAX_HEARD; ++heard) {
                const std::optional<Frame> frame = socket_.receive();
                if (!frame) break;
                hear(*frame, now);
            }
        } catch (const Refused &error) {
            refused_ = error;
            lose(error.what());
        } catch (const ProtocolError &error) {
            broken_ = true;
            lose(error.what());
        } catch (const ConnectionError &error) {
            lose(error.what());
        }
        return now;
    }
    void hear(const Frame &frame, double now) {
        if (frame.kind == Frame::Kind::Binary) {
            Bytes bytes(frame.data.begin(), frame.data.end());
            const Patch patch = Patch::decode(bytes.data(), bytes.size());
            loop_->give_patch(patch, now);
            if (patch.seq != 0) pacer_.reported(patch.t_client, patch.sample_wait);
            return;
        }
        const Json message = Json::parse(frame.data);
        const std::string &type = message.text_at("type");
        if (type == "error") throw refusal(message);
        if (type == "restraints") {
            const Json *frozen = message.find("frozen"), *muted = message.find("muted");
            restrained_ = frozen != nullptr && frozen->boolean;
            if (muted == nullptr) return;
            for (const Json &user : muted->items) {
                restrained_ = restrained_ || user.number == static_cast<double>(welcome_.user);
            }
        } else if (type == "recorded") {
            const Json *on = message.find("on");
            recorded_ = on != nullptr && on->boolean;
        } else if (type != "user_joined" && type != "user_left" && type != "named") {
            detail::refuse("message", type,
                           "patch, user_joined, user_left, named, restraints or recorded");
        }
    }
    void lose(const char *why) {
        why_ = why;
        socket_.abandon();
        loop_->let_go();
    }
    /// Sends the sample of this period if one is due.
    Vec3 end(const Vec3 &force, double now) {
        stepped_ = true;
        if (!why_.empty() && loop_->free()) {
            if (refused_) throw Refused(*refused_);
            if (broken_) throw ProtocolError(why_);
            throw ConnectionError(why_);
        }
        if (!connected() || pacer_.due > now) return force;
        pacer_.sent(now);
        try {
            // Only the newest sample counts: the next one follows a period later.
            if (!socket_.is_behind()) send_sample(now, false);
        } catch (const ConnectionError &error) {
            lose(error.what());
        }
        return force;
    }
    void send_sample(double now, bool last) {
        const Bytes frame = loop_->sample(now, last);
        socket_.send(Frame::Kind::Binary, std::string(frame.begin(), frame.end()));
    }
};

}  // namespace cohaptic

#endif  // COHAPTIC_HPP
