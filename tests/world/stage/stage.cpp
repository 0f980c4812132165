// SPDX-License-Identifier: MIT
#include "tests/world/stage/stage.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>

#include "tests/world/daemon_image.h"
#include "tests/world/stage/devices.h"

namespace compbox::world {

namespace {

std::string hex_of(const std::string &bytes) {
    static const char digits[] = "0123456789abcdef";
    std::string text;
    for (const auto letter : bytes) {
        const auto byte = static_cast<unsigned char>(letter);
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

std::string bytes_of(const std::string &hex) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
        bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    return bytes;
}

}  // namespace

// ---- calls

call_fate call_failures::at_call(const call_site &site) {
    for (rule &one : rules) {
        if (one.times == 0 || one.call != site.name) continue;
        if (std::strstr(site.path, one.path.c_str()) == nullptr) continue;
        if (one.skipped > 0) {
            --one.skipped;
            continue;
        }
        if (one.times > 0) --one.times;
        met(site);
        call_fate fate;
        fate.error = one.error;
        fate.delay_ns = one.lasts_ns;
        return fate;
    }
    return {};
}

// ---- commands

const std::map<std::string, stage::command> stage::commands = {
    {"run", &stage::run},
    {"start", &stage::start},
    {"signal", &stage::signal},
    {"boot", &stage::boot},
    {"cut_power", &stage::cut_power},
    {"suspend", &stage::suspend},
    {"clocks", &stage::clocks},
    {"set_clock", &stage::set_clock},
    {"fail", &stage::fail},
    {"heal", &stage::heal},
    {"held", &stage::held},
    {"flip", &stage::flip},
    {"can", &stage::set_can},
    {"frame", &stage::put_frame},
    {"line", &stage::set_line},
    {"line_send", &stage::send_line},
    {"control", &stage::start_control},
    {"control_end", &stage::end_control},
    {"control_say", &stage::command_control},
    {"control_ask", &stage::ask_control},
    {"stall", &stage::stall},
    {"put", &stage::put},
    {"get", &stage::get},
    {"rename", &stage::rename},
    {"remove", &stage::remove},
    {"make", &stage::make},
    {"disk", &stage::disk},
    {"listen", &stage::listen},
    {"send", &stage::send},
    {"hang_up", &stage::hang_up}};

stage::stage(std::uint64_t seed) : box_(time_, seed), net_(box_, seed), can_(box_) {
    box_.make_socket = [this](int domain, int) -> std::shared_ptr<open_file> {
        if (domain == AF_CAN) return can_.make_socket();
        if (domain == AF_UNIX)
            return make_supervisor(
                [this](const std::string &text) {
                    happened({{"event", "notified"}, {"text", text}});
                },
                [this](const std::string &name) { return can_.is_up(name); });
        return domain == AF_INET || domain == AF_INET6 ? make_tcp_socket(net_) : nullptr;
    };
    box_.logged = [this](const std::string &line) { log_ += line + "\n"; };
    box_.ended = [this](const ending &how) {
        happened({{"event", "ended"}, {"code", how.by_signal ? -how.code : how.code}});
    };
    failures_.met = [this](const call_site &site) {
        happened({{"event", "failed"}, {"call", site.name}, {"path", site.path}});
    };
    can_.bound = [this](const std::string &name, const std::vector<can_filter> &filters) {
        json list = json::array();
        for (const auto &one : filters) list.push_back({one.can_id, one.can_mask});
        happened({{"event", "bound"}, {"interface", name}, {"filters", list}});
    };
    can_.sent = [this](const std::string &name, const can_frame &frame) {
        const std::string data(reinterpret_cast<const char *>(frame.data), frame.can_dlc);
        happened({{"event", "frame"},
                  {"interface", name},
                  {"id", frame.can_id},
                  {"data", hex_of(data)}});
    };
    box_.faults = &failures_;
    box_.boot();
}

std::string stage::obey(const std::string &line) {
    json answer = json::object();
    try {
        json arguments = json::parse(line);
        const auto found = commands.find(arguments.at(0).get<std::string>());
        if (found == commands.end()) throw std::invalid_argument("there is no such command");
        arguments.erase(0);
        (this->*found->second)(arguments, answer);
    } catch (const std::exception &error) {
        answer["error"] = error.what();
    }
    answer["now"] = time_.now();
    if (!events_.empty()) answer["events"] = std::exchange(events_, {});
    if (!log_.empty()) answer["log"] = hex_of(std::exchange(log_, {}));
    return answer.dump();
}

void stage::happened(json event) {
    events_.push_back(std::move(event));
    time_.stop();
}

// ---- time and process

void stage::run(const json &arguments, json &) {
    const std::uint64_t mine = ++alarms_;
    time_.at(arguments.at(0).get<time_ns>(), [this, mine] {
        if (mine == alarms_) time_.stop();
    });
    time_.run();
}

void stage::start(const json &arguments, json &) {
    box_.environment = arguments.at(1).get<std::map<std::string, std::string>>();
    box_.start_daemon(arguments.at(0).get<std::vector<std::string>>());
}

void stage::signal(const json &arguments, json &) {
    box_.send_signal(arguments.at(0).get<int>());
}

void stage::cut_power(const json &, json &) {
    box_.cut_power();
}

void stage::boot(const json &, json &) {
    box_.boot();
}

void stage::suspend(const json &arguments, json &) {
    box_.suspend(arguments.at(0).get<time_ns>());
}

void stage::clocks(const json &, json &answer) {
    answer["boottime"] = box_.boottime();
    answer["monotonic"] = box_.monotonic();
    answer["wall"] = box_.wall();
    answer["boot_id"] = box_.boot_id();
}

void stage::set_clock(const json &arguments, json &) {
    box_.set_wall_clock(arguments.at(0).get<time_ns>());
    box_.synchronised = arguments.at(1).get<bool>();
}

void stage::fail(const json &arguments, json &) {
    failures_.rules.push_back({arguments.at(0).get<std::string>(),
                               arguments.at(1).get<std::string>(), arguments.at(2).get<int>(),
                               arguments.at(3).get<time_ns>(), arguments.at(4).get<int>(),
                               arguments.at(5).get<int>()});
}

void stage::heal(const json &, json &) {
    failures_.rules.clear();
}

// Changes bits of a byte of the daemon's variables: so far behind the first place that holds these
// bytes.
void stage::flip(const json &arguments, json &) {
    const std::string wanted = bytes_of(arguments.at(0).get<std::string>());
    for (const auto &part : daemon_variables()) {
        char *const found = std::search(part.first, part.second, wanted.begin(), wanted.end());
        if (found == part.second) continue;
        found[arguments.at(1).get<int>()] ^= static_cast<char>(arguments.at(2).get<int>());
        return;
    }
    throw std::runtime_error("the daemon does not hold these bytes");
}

// The process, or its thread of this name, stands still for so long; "": all threads.
void stage::stall(const json &arguments, json &) {
    const time_ns until = time_.now() + arguments.at(0).get<time_ns>();
    const auto name = arguments.at(1).get<std::string>();
    for (const auto &one : time_.threads())
        if (name.empty() || one->name == name) time_.hold(*one, until);
}

// What the process holds.
void stage::held(const json &, json &answer) {
    if (!box_.runs()) return;
    const auto &process = box_.current_process();
    answer["descriptors"] =
        std::count_if(process.descriptors.begin(), process.descriptors.end(),
                      [](const auto &descriptor) { return descriptor != nullptr; });
    answer["blocks"] = process.heap.size();
    answer["threads"] = json::array();
    for (const auto &one : time_.threads()) answer["threads"].push_back(one->name);
}

// ---- files

void stage::put(const json &arguments, json &) {
    box_.files.put(arguments.at(0).get<std::string>(),
                   bytes_of(arguments.at(1).get<std::string>()));
}

void stage::get(const json &arguments, json &answer) {
    const auto found = box_.files.find(arguments.at(0).get<std::string>());
    if (found == nullptr) return;
    answer["bytes"] = hex_of(found->bytes);
    answer["modified"] = found->modified_ns;
    answer["regular"] = found->kind == node_kind::regular;
}

void stage::rename(const json &arguments, json &) {
    const auto from = arguments.at(0).get<std::string>(), to = arguments.at(1).get<std::string>();
    const int error = box_.files.rename(from, to);
    if (error != 0) throw std::runtime_error(std::strerror(-error));
}

void stage::remove(const json &arguments, json &) {
    box_.files.remove(arguments.at(0).get<std::string>());
}

// Makes what is no regular file.
void stage::make(const json &arguments, json &) {
    const auto kind = arguments.at(0).get<std::string>(), path = arguments.at(1).get<std::string>();
    if (kind == "folder") {
        box_.files.make_folder(path);
    } else if (kind == "fifo") {
        box_.files.make_fifo(path);
    } else if (kind == "watchdog") {
        const int most_s = arguments.at(2).get<int>();
        box_.files.make_device(path, [this, most_s, path] {
            return make_watchdog(most_s, [this, path](const std::string &bytes) {
                happened({{"event", "written"}, {"path", path}, {"bytes", hex_of(bytes)}});
            });
        });
    } else if (kind == "link") {
        box_.files.make_link(path, arguments.at(2).get<std::string>());
    } else {
        throw std::invalid_argument("there is no such kind of file");
    }
}

void stage::disk(const json &arguments, json &answer) {
    box_.files.capacity_bytes = arguments.at(0).get<std::int64_t>();
    box_.files.read_only = arguments.at(1).get<bool>();
    answer["used"] = box_.files.used_bytes();
}

// ---- network

void stage::listen(const json &arguments, json &) {
    const auto port = arguments.at(0).get<std::uint16_t>();
    tcp_peer &there = servers_.try_emplace(port, *this, port).first->second;
    net_.listen(port, arguments.at(1).get<bool>() ? &there : nullptr);
}

void stage::send(const json &arguments, json &) {
    const auto found = links_.find(arguments.at(0).get<int>());
    if (found != links_.end()) found->second->send(bytes_of(arguments.at(1).get<std::string>()));
}

void stage::hang_up(const json &arguments, json &) {
    const auto found = links_.find(arguments.at(0).get<int>());
    if (found == links_.end()) return;
    const connection_ptr link = found->second;
    links_.erase(found);
    if (arguments.at(1).get<bool>())
        link->reset();
    else
        link->finish();
}

// ---- other wires

void stage::set_can(const json &arguments, json &) {
    using state = can_bus::interface_state;
    const auto word = arguments.at(1).get<std::string>();
    can_.set(arguments.at(0).get<std::string>(), word == "up"     ? state::up
                                                 : word == "down" ? state::down
                                                                  : state::gone);
}

void stage::put_frame(const json &arguments, json &) {
    const std::string data = bytes_of(arguments.at(2).get<std::string>());
    can_frame frame = {};
    frame.can_id = arguments.at(1).get<canid_t>();
    frame.can_dlc = static_cast<std::uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.data);
    can_.put(arguments.at(0).get<std::string>(), frame);
}

// in : a device; whether its adapter is there
void stage::set_line(const json &arguments, json &) {
    const auto device = arguments.at(0).get<std::string>();
    auto &line = lines_[device];
    if (line == nullptr) {
        line = std::make_unique<serial_line>(box_, device, 1);
        line->heard = [this, device](const fakeplc::byte_string &bytes, time_ns) {
            happened({{"event", "heard"},
                      {"device", device},
                      {"bytes", hex_of({bytes.begin(), bytes.end()})}});
        };
    }
    line->plug(arguments.at(1).get<bool>());
}

void stage::send_line(const json &arguments, json &) {
    const std::string bytes = bytes_of(arguments.at(1).get<std::string>());
    lines_.at(arguments.at(0).get<std::string>())
        ->send(fakeplc::byte_string(bytes.begin(), bytes.end()), 0);
}

// ---- fakeplc

// in : options of the program, {"--profile": …}; a TCP port, or the device of a serial line
void stage::start_control(const json &arguments, json &) {
    const json &given = arguments.at(0), &where = arguments.at(1);
    fakeplc::plc_options options;
    options.profile = given.value("--profile", "");
    options.machine = given.value("--machine", "");
    options.map = given.value("--map", "");
    if (given.contains("--size-um"))
        options.size_um = std::stod(given.at("--size-um").get<std::string>());
    json ignored;
    if (where.is_string()) set_line(json::array({where, true}), ignored);
    control_ = std::make_unique<control>(
        net_, options, given.value("--log", ""),
        where.is_string() ? std::uint16_t{0} : where.get<std::uint16_t>(),
        where.is_string() ? lines_.at(where.get<std::string>()).get() : nullptr);
}

void stage::end_control(const json &, json &) {
    control_.reset();
}

void stage::command_control(const json &arguments, json &answer) {
    answer["answer"] = control_->run(arguments.at(0).get<std::string>());
}

void stage::ask_control(const json &arguments, json &answer) {
    const std::string request = bytes_of(arguments.at(0).get<std::string>());
    const fakeplc::byte_string reply =
        control_->ask(fakeplc::byte_string(request.begin(), request.end()));
    answer["reply"] = hex_of({reply.begin(), reply.end()});
}

bool stage::server::accepted(const connection_ptr &from) {
    from->number = ++of.links_made_;
    of.links_[from->number] = from;
    of.happened({{"event", "connected"}, {"link", from->number}, {"port", port}});
    return true;
}

void stage::server::received(const connection_ptr &from, const std::string &bytes, time_ns) {
    of.happened({{"event", "received"}, {"link", from->number}, {"bytes", hex_of(bytes)}});
}

void stage::server::closed(const connection_ptr &from, bool reset) {
    if (of.links_.count(from->number) == 0) return;
    if (reset) of.links_.erase(from->number);
    of.happened({{"event", "closed"}, {"link", from->number}, {"reset", reset}});
}

}  // namespace compbox::world
