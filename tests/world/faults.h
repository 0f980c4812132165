// SPDX-License-Identifier: MIT
// The kinds of faults, and the injector that the calls, the network and the PLC ask. Each kind has
// dice of its own: a kind that is left out (--faults) does not change what the others draw.
//
// A new kind: its line in WORLD_FAULTS, and its work in faults_*.cpp: either a part of at_call,
// at_segment, at_connect, at_request or between_lines, or an event that plans its own next one.
// What lasts beyond an event ends in heal().
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/world/computer.h"
#include "tests/world/dice.h"
#include "tests/world/network.h"
#include "tests/world/plc_side.h"
#include "tests/world/serial_line.h"

namespace compbox::world {

class run;

#define WORLD_FAULTS(X)                                                        \
    X(preempt, "other threads run between two lines")                          \
    X(delay, "calls and segments that take long")                              \
    X(tear, "segments in two parts")                                           \
    X(loss, "replies that never come, connections that stall")                 \
    X(reset, "connections reset, refused, closed")                             \
    X(twice, "replies that come twice")                                        \
    X(exception, "Modbus exceptions, functions refused, torn readings")        \
    X(enable, "the operator changes enable, reference, permit, presses reset") \
    X(refuse, "system calls that fail, with each errno that they may give")    \
    X(partial, "short reads and writes, and calls that are interrupted")       \
    X(kill, "the process is killed, at a call or between two lines")           \
    X(power_cut, "power cuts: what was not synchronised may be lost")          \
    X(restart, "the operator restarts the service")                            \
    X(disk, "disks that are full, read-only, or hang")                         \
    X(reload, "SIGHUP floods; files replaced, half written, gone")             \
    X(hostile, "coefficient files that chance has changed")                    \
    X(state, "state files that are damaged, old, or no file")                  \
    X(clock, "wall clocks that jump, and are wrong after a boot")              \
    X(suspend, "the machine is suspended")                                     \
    X(stall, "single threads that do not run")                                 \
    X(memory, "bits of the configuration flip in memory")                      \
    X(wire, "bits of frames flip")                                             \
    X(foreign, "other clients write, or take the connections")                 \
    X(sensors, "signals that lie")                                             \
    X(plc_stop, "the PLC stops, starts again, is unplugged")                   \
    X(line, "serial lines lose bytes, flip bits, pause, are unplugged")        \
    X(can, "CAN goes down, off the bus, away; nodes fall silent, boot again")  \
    X(boundary, "long uptimes, counters about to wrap")                        \
    X(slow, "a PLC whose replies take most of a period")                       \
    X(stray, "replies of another unit, function or length")                    \
    X(reader, "the reader of the log stops reading, or systemd")               \
    X(links, "symbolic links in the place of outputs and of their new files")  \
    X(mute, "a PLC that answers readings, but writes or read-backs not or wrongly")

enum class fault_kind {
#define X(name, words) name,
    WORLD_FAULTS(X)
#undef X
};
#define X(name, words) +1
constexpr std::size_t fault_kinds = 0 WORLD_FAULTS(X);
#undef X

using fault_set = std::set<fault_kind>;
using fault_limits = std::map<fault_kind, std::uint64_t>;

// in : "all", "none" or names with commas between them, each with the most of its occurrences if
//      fewer than all: "kill:3,delay". Throws std::invalid_argument with a sentence.
fault_set fault_set_of(const std::string &text);
fault_limits fault_limits_of(const std::string &text);
std::string name_of(fault_kind kind);
std::string text_of(const fault_set &kinds, const fault_limits &most = {});

// out: the kinds of a seed: of twenty seeds three have none, thirteen one to four, mostly one, one
//      has all, and three have some or many. With few kinds most invariants are judged at their
//      sharpest.
fault_set swarm_of(std::uint64_t seed);

class fault_injector : public call_faults,
                       public link_faults,
                       public plc_faults,
                       public line_faults {
  public:
    fault_injector(run &of, const fault_set &kinds, const fault_limits &most, std::uint64_t seed);

    // Plans the events of each kind. Call it once, when the world is made.
    void begin();
    // No more faults from now on; whatever lasts is put right: the world must recover.
    void end();
    bool active() const { return active_; }
    // The computer has booted; the daemon is about to start.
    void booted();
    // Whether the power goes behind a clean end of the daemon.
    bool cuts_power();
    // out: how much longer than usual no daemon runs; PLC and machine go on
    time_ns stays_off();
    void starting();
    void stopping();             // the daemon gets SIGTERM next
    bool refuses_lines = false;  // a line of the log may be lost

    bool has(fault_kind kind) const { return active_ && on_[index(kind)]; }
    dice &chance(fault_kind kind) { return chances_[index(kind)]; }
    // Remembers it for the report of a violation.
    void note(fault_kind kind, const std::string &words);
    void count_one() { ++count_; }  // one that is too frequent for the report
    const std::vector<std::string> &last() const { return last_; }
    std::uint64_t count() const { return count_; }

    call_fate at_call(const call_site &site) override;
    preemption between_lines() override;
    segment_fate at_segment(bool to_box, std::size_t bytes) override;
    segment_fate at_connect() override;
    bool module_refuses(int unit) const;
    bool module_is_silent(int unit) const;
    reply_fate at_request(const fakeplc::byte_string &request) override;
    line_fate at_line(bool to_box) override;

  private:
    static std::size_t index(fault_kind kind) { return static_cast<std::size_t>(kind); }
    // Comes once in `mean` questions, by the seed's rate of the kind.
    struct countdown {
        fault_kind kind;
        std::uint64_t mean;
        std::uint64_t left = 0;
        bool drawn = false;
    };
    bool due(countdown &of);
    // out: another one of this kind may occur, which it then does
    bool takes_one(fault_kind kind);
    // Plans `what` again and again, `mean` apart by the seed's rate of the kind.
    void repeat(fault_kind kind, time_ns mean, const std::function<void()> &what);
    // Calls `what` later, also when faults have ended: for the end of something that lasts.
    void later(time_ns pause, const std::function<void()> &what);

    void plan_wires();
    void plan_modules();
    void be_deaf(std::size_t node, time_ns duration);  // faults_wires.cpp

    void plan_operator();  // faults_plc.cpp
    void set_references(bool on);
    void lose_while_off();
    void mute_while_it_stands();
    void plan_plc();
    void plan_foreign();
    void plan_sensors();
    void plan_long_silence();
    void disturb_redundant();
    void lie_together(dice own);
    void be_off(const std::string &sensor, double off, time_ns pause);
    void enable_too_early(dice own);
    void lose_position();
    void lose_velocity(const fakeplc::shown_signal &signal);
    void lie_about(const fakeplc::shown_signal &signal);
    void lie_on(const fakeplc::shown_signal &signal, int way, double value, time_ns until);
    void replace_what_is_read(const call_site &site);
    double beyond_error(std::size_t c, dice &drawn);
    void lie_about_applied(dice &drawn);
    void lie_about_another(std::size_t c, time_ns lasts, dice &drawn);
    void write_again_and_again(dice &drawn);
    void write_each(time_ns pause, time_ns until, int at, const std::vector<std::uint16_t> &words);
    void show_applied(std::size_t c, const std::vector<std::uint16_t> &words, time_ns lasts);
    struct shown_words {
        std::vector<std::uint16_t> words;  // empty: what is true
        time_ns lasts;
    };
    void show_in_turn(int at, std::array<shown_words, 2> turns, time_ns until);
    void meddle_before_start();
    void hide_block();
    void plan_slowness();
    void plan_muteness();
    bool is_read_back(const fakeplc::byte_string &request) const;
    bool is_mute(const fakeplc::byte_string &request) const;
    bool is_lost_again(const fakeplc::byte_string &request);
    stray_reply draw_stray(const fakeplc::byte_string &request);
    bool is_late_write(std::size_t bytes);
    void pause_behind_read_back();
    time_ns draw_delay();
    time_ns until_deadline();
    time_ns draw_late();
    void write_back_late(dice &drawn);
    void tear_pair(time_ns until, double first_um, double second_um);
    void write_back(const fakeplc::taken_channel &channel, time_ns pause);
    double in_plc_um(const fakeplc::taken_channel &channel) const;
    void heal_plc();

    void plan_ends();  // faults_computer.cpp
    void end_daemon();
    void plan_stalls();
    void stall_again_and_again(dice &drawn);
    void hold_loop(std::int64_t times);
    void plan_clock();
    void plan_memory();
    void plan_reader();
    void withdraw_permission(dice &drawn);
    void jump_before_start();
    void die_if_due(std::int64_t &left);
    void die();
    void interrupt(const call_site &site, call_fate &fate);
    dice *weak(const call_site &site);
    void refuse_call(const call_site &site, call_fate &fate);
    void heal_computer();

    void plan_files();  // faults_files.cpp
    void plan_disk();
    void fill_disk(std::int64_t takes, time_ns lasts);
    void plan_links();
    void remove_link(const std::string &path);
    void put_another_file();
    void put_unsigned_file();
    void put_file_for_a_restart();
    void spoil_key(dice &own);
    bool starts() const;  // the daemon, more than once
    void put_hostile_file();
    void replace_later(time_ns pause, const std::string &text);
    void spoil_config_path();
    void spoil_state();
    bool is_on_disk(const call_site &site) const;
    void heal_files();

    run &of_;
    std::array<bool, fault_kinds> on_{};
    std::vector<dice> chances_;
    std::array<double, fault_kinds> rates_{};
    std::array<std::uint64_t, fault_kinds> left_{};  // occurrences
    std::vector<std::string> last_;
    std::uint64_t count_ = 0;
    bool active_ = true;

    countdown slow_calls_{fault_kind::delay, 5000}, slow_segments_{fault_kind::delay, 200},
        late_writes_{fault_kind::delay, 100}, torn_segments_{fault_kind::tear, 50},
        stalls_{fault_kind::loss, 5000}, resets_{fault_kind::reset, 5000},
        refused_calls_{fault_kind::refuse, 3000}, short_calls_{fault_kind::partial, 20},
        flips_{fault_kind::wire, 2000}, lost_replies_{fault_kind::loss, 500},
        series_of_losses_{fault_kind::loss, 600}, twice_{fault_kind::twice, 500},
        lost_ends_{fault_kind::reset, 1000}, exceptions_{fault_kind::exception, 500},
        torn_readings_{fault_kind::exception, 200}, strays_{fault_kind::stray, 300};
    // Calls that are seldom fail often: one of so many, by these dice.
    struct weak_calls {
        bool are_weak;
        unsigned many;
        dice chance;
        std::vector<std::string> names;
    };
    std::array<weak_calls, 3> weak_calls_;
    // Until then a call, a function or the disk refuses.
    std::string stormy_call_;
    int stormy_error_ = 0;
    time_ns storm_until_ = 0, refuses_until_ = 0;
    int refusing_unit_ = 0;  // a module of the bus, until …
    time_ns refusing_until_ = 0;
    int silent_unit_ = 0;  // one without a reply
    time_ns silent_from_ = 0, silent_to_ = 0;
    time_ns renames_fail_until_ = 0, resets_until_ = 0;
    int writes_ = 0;
    time_ns hides_block_until_ = 0;  // the PLC refuses to return the write block
    time_ns loses_until_ = 0;        // replies to writes get lost again and again …
    const bool bad_cable_;           // … always
    time_ns silent_until_ = 0;       // its server answers nothing …
    // … or no writes, or does not return the write block
    time_ns no_writes_until_ = 0, no_read_backs_until_ = 0;
    bool garbles_ = false;         // … but with replies that nobody can take
    bool delays_write_ = false;    // the next one of an output that moves fast …
    std::vector<double> sent_um_;  // … by what the PLC had at the request before
    time_ns gateway_until_ = 0;    // another device answers writes in its place
    time_ns slow_until_ = 0, slow_ns_ = 0;
    int refused_function_ = 0, refused_code_ = 0;
    // Calls and lines until the process ends; below 0: nothing is planned.
    std::int64_t lethal_calls_ = -1, lethal_lines_ = -1;
    bool lethal_power_ = false, dies_behind_rename_ = false;
    dice own_;   // of ends at a rename
    dice deaf_;  // of systemd, which reads no message until …
    time_ns deaf_until_ = 0;
    dice threads_;             // of those that a start gets
    dice halves_;              // of torn replies around a deadline
    int refused_thread_ = -1;  // so many come before it; below 0: none is refused
    dice echoes_;              // of replies to writes
    dice stops_;               // of the disk that a daemon ends on
    dice pauses_;              // behind read-backs
    dice gaps_;                // of replies that nobody can take: some do not come at all
    std::string silent_;       // a signal without a value for more than half an hour
    std::uint64_t foreign_made_ = 0;
    std::string older_state_;
    int lies_ = 0;
};

}  // namespace compbox::world
