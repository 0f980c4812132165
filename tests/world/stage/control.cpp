// SPDX-License-Identifier: MIT
#include "tests/world/stage/control.h"

#include <algorithm>
#include <map>

#include "host-tools/fakeplc/rtu.h"

namespace compbox::world {

namespace {

class tcp_wire : public stage_wire, public tcp_peer {
  public:
    tcp_wire(network &net, std::uint16_t port, int max_clients)
        : stage_wire(net.box.time), net_(net), port_(port), max_clients_(max_clients) {
        net.listen(port, this);
    }
    ~tcp_wire() override {
        net_.listen(port_, nullptr);
        drop_all();
    }
    std::string address() const override { return "127.0.0.1:" + std::to_string(port_); }
    std::size_t clients() const override { return clients_.size(); }
    void close_all_clients() override { drop_all(); }
    void go_away(int duration_ms) override {
        drop_all();
        away_until_ = time_.now() + duration_ms * ms;
    }

    bool accepted(const connection_ptr &from) override {
        if (time_.now() < away_until_ || clients_.size() >= static_cast<std::size_t>(max_clients_))
            return false;
        from->number = ++made_;
        clients_[from->number].link = from;
        return true;
    }
    void closed(const connection_ptr &from, bool reset) override {
        clients_.erase(from->number);
        if (!reset) from->finish();
    }
    void received(const connection_ptr &from, const std::string &bytes, time_ns) override {
        fakeplc::byte_string &all = clients_[from->number].received;
        all.insert(all.end(), bytes.begin(), bytes.end());
        for (;;) {
            const auto head = fakeplc::modbus::frame_at_start(all);
            if (head.what == fakeplc::modbus::frame_state::incomplete) return;
            if (head.what == fakeplc::modbus::frame_state::broken) {
                from->reset();
                return;
            }
            const auto end = all.begin() + static_cast<std::ptrdiff_t>(head.size);
            answer_frame(from, fakeplc::byte_string(all.begin(), end));
            all.erase(all.begin(), end);
        }
    }

  private:
    struct client {
        connection_ptr link;
        fakeplc::byte_string received;
    };
    void drop_all() {
        const auto all = std::move(clients_);
        clients_.clear();
        for (const auto &entry : all) entry.second.link->finish();
    }
    void answer_frame(const connection_ptr &from, const fakeplc::byte_string &frame) {
        std::optional<fakeplc::fault> what;
        const fakeplc::byte_string request(frame.begin() + fakeplc::modbus::header_size,
                                           frame.end());
        const fakeplc::byte_string reply = reply_to(request, &what);
        for (const auto &part : fakeplc::spoil(fakeplc::modbus::frame(frame, reply), what))
            from->send(std::string(part.bytes.begin(), part.bytes.end()), part.delay_ms * ms);
    }

    network &net_;
    std::uint16_t port_;
    int max_clients_, made_ = 0;
    time_ns away_until_ = 0;
    std::map<int, client> clients_;
};

class rtu_wire : public stage_wire {
  public:
    rtu_wire(serial_line &line, scheduler &time) : stage_wire(time), line_(line) {
        line.heard = [this](const fakeplc::byte_string &bytes, time_ns) { hear(bytes); };
    }
    ~rtu_wire() override { line_.heard = nullptr; }
    std::string address() const override { return "rtu"; }
    std::size_t clients() const override { return 1; }
    void close_all_clients() override { go_away(1); }
    void go_away(int duration_ms) override {
        line_.plug(false);
        time_.at(time_.now() + duration_ms * ms, [&line = line_] { line.plug(true); });
    }

  private:
    static constexpr std::uint8_t unit = 1;
    static constexpr time_ns silence = 1750 * us, forgotten = 20 * ms;

    void hear(const fakeplc::byte_string &bytes) {
        if (time_.now() - heard_ns_ > forgotten) received_.clear();
        heard_ns_ = time_.now();
        received_.insert(received_.end(), bytes.begin(), bytes.end());
        const std::size_t size = fakeplc::rtu::request_size(received_);
        if (size == 0 || received_.size() < size) return;
        const fakeplc::byte_string frame = std::exchange(received_, {});
        if (!fakeplc::rtu::is_frame(frame) || frame[0] != unit) return;
        std::optional<fakeplc::fault> what;
        const fakeplc::byte_string reply =
            reply_to(fakeplc::byte_string(frame.begin() + 1, frame.end() - 2), &what);
        for (const auto &part : fakeplc::rtu::spoil(unit, reply, what))
            line_.send(part.bytes, silence + part.delay_ms * ms);
    }

    serial_line &line_;
    fakeplc::byte_string received_;
    time_ns heard_ns_ = 0;
};

std::unique_ptr<stage_wire> make_wire(network &net, std::uint16_t port, serial_line *line,
                                      int max_clients) {
    if (line != nullptr) return std::make_unique<rtu_wire>(*line, net.box.time);
    return std::make_unique<tcp_wire>(net, port, max_clients);
}

}  // namespace

fakeplc::byte_string stage_wire::reply_to(const fakeplc::byte_string &request,
                                          std::optional<fakeplc::fault> *what) {
    *what = faults_.take(request[0]);
    if (*what && (*what)->kind == fakeplc::fault_kind::exception)
        return fakeplc::modbus::exception_reply(request[0],
                                                static_cast<std::uint8_t>((*what)->value));
    return answer(request, *what && (*what)->kind == fakeplc::fault_kind::torn);
}

control::control(network &net, const fakeplc::plc_options &options, const std::string &log_file,
                 std::uint16_t port, serial_line *line)
    : time_(net.box.time),
      setup_(fakeplc::prepare(options)),
      plc_(setup_.twin, setup_.map, setup_.profile, net.box.time.now() / us),
      wire_(make_wire(net, port, line, setup_.profile.max_clients)),
      console_{plc_, *wire_} {
    if (!log_file.empty()) log_.emplace(log_file, setup_.map);
    wire_->answer = [this](const fakeplc::byte_string &request, bool torn) {
        catch_up();
        return plc_.answer(request, torn);
    };
    plan();
}

control::~control() {
    *here_ = false;
    if (log_) log_->flush();
}

void control::catch_up() {
    plc_.run_to(time_.now() / us, [this](const fakeplc::plc_state &state) {
        if (log_) log_->add(state);
    });
}

void control::plan() {
    time_.at(std::max(plc_.next_due_us() * us, time_.now()), [this, here = here_] {
        if (!*here) return;
        catch_up();
        plan();
    });
}

std::string control::run(const std::string &command) {
    catch_up();
    const std::string answer = console_.run(command);
    if (log_) log_->flush();
    return answer;
}

fakeplc::byte_string control::ask(const fakeplc::byte_string &request) {
    catch_up();
    return plc_.answer(request);
}

}  // namespace compbox::world
