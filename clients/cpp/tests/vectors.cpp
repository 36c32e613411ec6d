// Answers the questions of tests/clients_cpp/test_cpp_client.py, a line each, with what the header
// makes of them: so vectors in JSON need no reader here, and a hand may be simulated over there.
// An error that the header throws is answered with `error` and its words.
//
//     vectors < questions
//     vectors rubbish SEED COUNT     damaged frames, texts and streams for every reader
//
// SPDX-License-Identifier: Apache-2.0

#include "../cohaptic.hpp"

#include <cstdlib>
#include <iostream>
#include <memory>

namespace {

using namespace cohaptic;

double number(std::istream &in) {
    std::string word;
    if (!(in >> word)) throw std::logic_error("a number is missing");
    return std::strtod(word.c_str(), nullptr);  // also nan and inf
}
Vec3 vec(std::istream &in) {
    const double x = number(in), y = number(in), z = number(in);
    return {x, y, z};
}
std::string bytes_of(const std::string &hex) {
    std::string out;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        out += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    }
    return out;
}
template <class Container>
std::string hex_of(const Container &data) {
    static constexpr char digits[] = "0123456789abcdef";
    std::string out;
    for (const auto c : data) {
        out += digits[static_cast<unsigned char>(c) >> 4];
        out += digits[static_cast<unsigned char>(c) & 15];
    }
    return out;
}

struct Line {
    std::ostringstream out;
    Line() { out.precision(17); }
    Line &operator<<(double value) { out << value << ' '; return *this; }
    Line &operator<<(const Vec3 &v) { return *this << v.x << v.y << v.z; }
    Line &operator<<(const Sight &s) {
        return *this << s.depth << s.normal << s.c_ii << s.own_force << s.u_others;
    }
    Line &operator<<(const Patch &p) {
        return *this << p.tick << p.seq << p.t_server << p.t_client << p.sample_wait << p.x_free
                     << p.normal << p.curvature << p.c_ii << p.k_h << p.own_force << p.u_others
                     << p.lag;
    }
};

Sight sight(std::istream &in) {
    Sight s;
    s.depth = number(in);
    s.normal = vec(in);
    s.c_ii = number(in);
    s.own_force = vec(in);
    s.u_others = vec(in);
    return s;
}
Patch surface(std::istream &in) {
    Patch p;
    p.x_free = vec(in);
    p.normal = vec(in);
    p.curvature = number(in);
    p.c_ii = number(in);
    p.own_force = vec(in);
    p.u_others = vec(in);
    return p;
}

/// JSON again, so that Python can compare what was understood.
void write(std::ostream &out, const Json &json) {
    const char *comma = "";
    switch (json.kind) {
        case Json::Kind::Null: out << "null"; break;
        case Json::Kind::Boolean: out << (json.boolean ? "true" : "false"); break;
        case Json::Kind::Number: out << detail::text_of(json.number, 17); break;
        case Json::Kind::Text: out << quoted(json.text); break;
        case Json::Kind::List:
            out << '[';
            for (const Json &item : json.items) {
                out << comma;
                write(out, item);
                comma = ",";
            }
            out << ']';
            break;
        case Json::Kind::Object:
            out << '{';
            for (const auto &member : json.members) {
                out << comma << quoted(member.first) << ':';
                write(out, member.second);
                comma = ",";
            }
            out << '}';
    }
}

/// What is remembered from question to question.
struct Memory {
    Guard guard;
    Pacer pacer;
    std::unique_ptr<Loop> loop;
};

std::string answer(const std::string &about, std::istream &in, Memory &memory) {
    Line line;
    if (about == "sample") {
        ContactSample sample;
        sample.seq = static_cast<std::uint32_t>(number(in));
        sample.tick = static_cast<std::uint32_t>(number(in));
        sample.t_client = number(in);
        sample.probe = vec(in);
        sample.force = vec(in);
        return hex_of(sample.encode());
    }
    if (about == "patch") {
        std::string hex;
        in >> hex;
        const std::string data = bytes_of(hex);
        line << Patch::decode(reinterpret_cast<const std::uint8_t *>(data.data()), data.size());
    } else if (about == "look") {
        const Patch patch = surface(in);
        line << look(patch, vec(in));
    } else if (about == "blend" || about == "shift") {
        const Sight a = sight(in), b = sight(in);
        line << (about == "blend" ? blend(a, b, number(in)) : shift(a, difference(b, a)));
    } else if (about == "turn") {
        const Vec3 normal = vec(in), target = vec(in);
        const auto turned = detail::turn_back(normal, target, number(in));
        line << turned.first << turned.second;
    } else if (about == "law") {
        const double depth = number(in);
        line << predictive_force(depth, number(in));
    } else if (about == "pacer") {
        memory.pacer = Pacer{number(in), 0.0};
        memory.pacer.due = number(in);
    } else if (about == "report") {
        const double t_client = number(in), wait = number(in);
        memory.pacer.reported(t_client, wait);
        memory.pacer.sent(number(in));
        line << memory.pacer.due;
    } else if (about == "guard") {
        Limits limits;
        limits.max_force = 6.0;  // as in tests/client/loop/law_vectors.py
        limits.engage_time = 0.05;
        Asked asked;
        asked.now = number(in);
        asked.dt = memory.guard.now ? std::max(0.0, asked.now - *memory.guard.now) : 0.0;
        asked.counted = std::min(asked.dt, 2.0 * limits.period);
        asked.force = vec(in);
        asked.velocity = vec(in);
        asked.silent = number(in) != 0.0;
        asked.surface = true;
        asked.fade_limit = FADE_RATE * asked.counted;
        asked.own = std::numeric_limits<double>::infinity();
        memory.guard = guarded(memory.guard, asked, limits);
        const Guard &after = memory.guard;
        line << after.force << after.scale << after.left
             << (after.mode == Guard::Mode::Engaged ? 1.0 : 0.0);
        line.out << after.fault;
    } else if (about == "loop") {
        Settings settings;
        const double period = number(in);
        settings.max_stiffness = number(in);
        settings.max_damping = number(in);
        settings.engage_time = number(in);
        settings.stall = number(in);
        settings.latch = number(in) != 0.0;
        const double max_rate = number(in);
        settings.max_force = number(in);
        Limits limits = Loop::limits_of(period, settings);
        limits.max_rate = max_rate;
        memory.loop = std::make_unique<Loop>(period, settings, limits);
    } else if (about == "give") {
        const double now = number(in);
        Patch patch = surface(in);
        patch.tick = static_cast<std::uint32_t>(number(in));
        patch.t_server = number(in);
        patch.k_h = number(in);
        memory.loop->give_patch(patch, now);
    } else if (about == "acknowledge") {
        memory.loop->acknowledge();
    } else if (about == "let_go") {
        memory.loop->let_go();
    } else if (about == "step") {
        const Vec3 tip = vec(in), velocity = vec(in);
        const double now = number(in);
        const Vec3 force = memory.loop->step(tip, velocity, now);
        const Loop &loop = *memory.loop;
        line << force << loop.on_body() << loop.depth() << loop.k_h() << loop.patience()
             << loop.playout().behind << loop.passivity().owed << loop.passivity().stored
             << loop.guard().scale << loop.guard().left
             << (loop.guard().mode == Guard::Mode::Engaged ? 1.0 : 0.0)
             << (loop.is_silent(now) ? 1.0 : 0.0);
    } else if (about == "hello") {
        Settings settings;
        settings.max_damping = number(in);
        in >> settings.key >> std::ws;
        std::string name;
        std::getline(in, name);
        return hello(name, settings);
    } else if (about == "json") {
        std::string text;
        std::getline(in >> std::ws, text);
        write(line.out, Json::parse(text));
    } else if (about == "welcome") {
        std::string text;
        std::getline(in >> std::ws, text);
        const Welcome welcome = Welcome::read(Json::parse(text));
        line << static_cast<double>(welcome.user) << welcome.simulation_period << welcome.center
             << welcome.radius;
        line.out << welcome.name << '/' << welcome.body;
    } else if (about == "frames") {
        std::string hex;
        FrameReader reader;
        while (in >> hex) {
            const std::string data = bytes_of(hex);
            reader.feed(data.data(), data.size());
            while (const std::optional<Frame> frame = reader.next()) {
                line << static_cast<double>(static_cast<unsigned>(frame->kind));
                line.out << hex_of(frame->data) << ' ';
            }
        }
    } else if (about == "mask") {
        const auto key = static_cast<std::uint32_t>(number(in));
        std::string hex;
        in >> hex;
        return hex_of(make_frame(Frame::Kind::Binary, bytes_of(hex), key));
    } else if (about == "accept") {
        std::string key;
        in >> key;
        return detail::base64(detail::sha1(key));
    } else if (about == "address") {
        std::string url;
        in >> url;
        const Address address = Address::read(url);
        return address.host + ' ' + address.port + ' ' + address.path;
    } else {
        throw std::logic_error("no question is called " + about);
    }
    return line.out.str();
}

/// Feeds damaged bytes to every reader; whatever is not refused has to be safe to use.
int rubbish(unsigned seed, long count) {
    std::mt19937 random(seed);
    const auto below = [&random](std::size_t n) { return random() % n; };
    Vec3 last;
    double largest = 0.0;
    const auto is_safe = [&last, &largest](const Vec3 &force) {
        // Limits of the settings, and 1 N in a millisecond.
        const bool safe = is_finite(force) && norm(force) <= 10.0 && norm(force - last) <= 1.0;
        last = force;
        largest = std::max(largest, norm(force));
        return safe;
    };
    Patch good;
    good.x_free = {0.1, 0.0, 0.0};
    good.c_ii = 0.004;
    good.k_h = 250.0;
    const std::string welcome =
        R"({"type":"welcome","protocol":5,"user":2,"name":"r\u00e9","simulation_period":0.016,)"
        R"("to_wall":1e9,"body":{"name":"b","center":[0.0,-1e-3,0.5],"radius":0.1},"users":[]})";
    Settings settings;
    settings.latch = false;
    settings.max_damping = 5.0;
    Loop loop(1.0 / 60.0, settings);
    long refused = 0, taken = 0;
    double now = 0.0;
    for (long i = 0; i < count; ++i) {
        // A whole frame of our own, since only those come far into a reader.
        Bytes frame(wire::at_patch::SIZE, 0);
        detail::Writer out{frame};
        frame[0] = wire::PROTOCOL_VERSION;
        frame[1] = wire::at_patch::KIND;
        frame[2] = static_cast<std::uint8_t>(0x30u | (1 + below(2)));
        out.bits(wire::at_patch::tick, static_cast<std::uint64_t>(i) + 1, 4);
        out.f64(wire::at_patch::t_server, now);
        out.vec(wire::at_patch::x_free, good.x_free);
        out.vec(wire::at_patch::normal, good.normal);
        out.f32(wire::at_patch::c_ii, good.c_ii);
        out.f32(wire::at_patch::k_h, good.k_h);
        const std::size_t damage = below(4);
        for (std::size_t k = 0; k < damage; ++k) {
            frame[below(frame.size())] = static_cast<std::uint8_t>(below(256));
        }
        if (below(8) == 0) frame.resize(below(frame.size() + 1));
        if (below(8) == 0) frame.resize(frame.size() + below(40), 1);
        if (below(16) == 0) {
            for (std::uint8_t &byte : frame) byte = static_cast<std::uint8_t>(below(256));
        }
        try {
            loop.give_patch(frame, now);
            ++taken;
        } catch (const ProtocolError &) {
            ++refused;
        }
        for (int k = 0; k < 4; ++k) {
            now += 0.001;
            const double height = 0.008 * std::sin(2.0 * now);
            const Vec3 tip = below(20000) == 0 ? Vec3{std::nan(""), 0.0, 1e300}
                                               : Vec3{0.1, 0.0, height};
            if (!is_safe(loop.step(tip, now)) || !is_finite(loop.on_body())) return 1;
        }
        std::string text = welcome;
        if (below(20) == 0) text.resize(below(text.size()));
        for (std::size_t k = 0; k < damage && !text.empty(); ++k) {
            text[below(text.size())] = static_cast<char>(below(256));
        }
        if (below(100) == 0) text.insert(0, below(40), '[');
        try {
            const Welcome read = Welcome::read(Json::parse(text));
            if (!(read.simulation_period >= wire::MIN_PERIOD)) return 1;
            ++taken;
        } catch (const ProtocolError &) {
            ++refused;
        }
        FrameReader reader;
        std::string stream(1, static_cast<char>(below(256)));
        stream += static_cast<char>(below(128));
        stream.append(reinterpret_cast<const char *>(frame.data()), frame.size());
        try {
            for (const char c : stream) {  // a byte at a time, as a slow link brings them
                reader.feed(&c, 1);
                while (reader.next()) ++taken;
            }
        } catch (const ProtocolError &) {
            ++refused;
        }
    }
    std::cout << taken << ' ' << refused << ' ' << largest << std::endl;
    return 0;
}

}  // namespace

int main(int count, char **words) {
    if (count == 4 && std::string(words[1]) == "rubbish") {
        return rubbish(static_cast<unsigned>(std::atol(words[2])), std::atol(words[3]));
    }
    Memory memory;
    std::string text;
    while (std::getline(std::cin, text)) {
        std::istringstream in(text);
        std::string about;
        in >> about;
        try {
            const std::string said = answer(about, in, memory);
            std::cout << said << std::endl;
        } catch (const Error &error) {
            std::cout << "error " << error.what() << std::endl;
        }
    }
}
