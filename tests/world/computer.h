// SPDX-License-Identifier: MIT
// The box's computer: clocks, descriptors, signals, and one process, compboxd. calls_*.cpp answer
// the daemon's calls of libc on the computer that is `current`.
#pragma once

#include <dirent.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/world/dice.h"
#include "tests/world/files.h"
#include "tests/world/hash.h"
#include "tests/world/open_file.h"
#include "tests/world/scheduler.h"

namespace compbox::world {

// How a process ended.
struct ending {
    bool by_signal = false;  // code: of the signal, SIGKILL for a kill from outside
    int code = 0;
    bool power_cut = false;
};

// A call of the daemon, where a fault may come in.
struct call_site {
    const char *name;       // of libc: "write"
    const open_file *file;  // which it is about; nullptr: none
    const char *path;       // which it is about, or that of the file; "" without one
};

// What happens to a call.
struct call_fate {
    int error = 0;            // errno that the call fails with, without effect; 0: it works
    time_ns delay_ns = 0;     // beyond its usual duration
    bool is_on_disk = false;  // it waits as long as the disk hangs
    bool half = false;        // write, read and send: half of the bytes
};

// Other threads run for so long; the next such question comes after so many lines.
struct preemption {
    time_ns duration_ns;
    std::int64_t lines;
};

// Whoever injects faults into calls (faults.h). It may also call computer::kill().
class call_faults {
  public:
    virtual ~call_faults() = default;
    virtual call_fate at_call(const call_site &site) = 0;
    // Between two lines of the daemon.
    virtual preemption between_lines() = 0;
};

class computer {
  public:
    computer(scheduler &time, std::uint64_t seed);
    ~computer();
    computer(const computer &) = delete;
    computer &operator=(const computer &) = delete;

    scheduler &time;
    file_tree files;
    run_hash hash;
    call_faults *faults = nullptr;

    // ---- power and process; each may be called in an event or, by a fault, in a call
    // Switches it on: clocks, boot id. The daemon starts by start_daemon().
    void boot();
    void start_daemon(const std::vector<std::string> &arguments);
    bool runs() const { return process_ != nullptr; }
    void send_signal(int number);  // SIGKILL too
    void kill() { send_signal(9); }
    void cut_power();  // the process is gone, the disk keeps what is durable, peers hear nothing
    // Nothing runs for so long; CLOCK_MONOTONIC stands still. None begins within another.
    void suspend(time_ns duration);
    void end_suspend();                 // before its time; the threads are released
    void skip(time_ns duration);        // a suspend of all the world
    void set_wall_clock(time_ns step);  // not before 1970, not after 2200
    void grow_old(time_ns uptime) { booted_ns_ -= uptime; }  // right after boot()
    // Called in an event after each end of the process.
    std::function<void(const ending &)> ended;
    std::function<void(const std::string &line)> logged;  // by stderr
    // What it says to systemd; "": the hardware watchdog is fed; "V": it is to be left alone.
    std::function<void(const std::string &words)> supervised;
    std::function<void(const std::string &path)> rename_failed;  // to this one
    std::function<void()> ticked;                                // the loop waits for its next tick

    // ---- clocks
    time_ns monotonic() const { return boottime() - suspended_ns_; }
    time_ns boottime() const { return time.now() - booted_ns_; }
    time_ns wall() const { return time.now() + wall_offset_ns_; }
    bool synchronised = true;  // of the wall clock
    const std::string &boot_id() const { return boot_id_; }

    // ---- for calls_*.cpp
    struct process {
        std::vector<std::string> arguments;
        std::vector<char *> argv;
        std::vector<std::shared_ptr<open_file>> descriptors;
        std::map<std::string, std::string> environment;
        std::set<void *> heap;
        std::set<int> ignored;            // signals
        std::vector<std::string> listed;  // names of the folder that is read, the last one first
        dirent entry = {};                // the last one read
        std::uint64_t pending = 0;        // signals, bit N for signal N
        ending how;
        bool over = false;
    };
    process &current_process() { return *process_; }
    // Begins each call: time passes, others run, faults come in. out: its fate
    call_fate begin(const char *name, const open_file *file = nullptr, const char *path = nullptr);
    void preempt();
    // Until preempt() is called. Static, because each function of the daemon counts it.
    static inline std::int64_t lines_left = 0;
    std::shared_ptr<open_file> descriptor(int fd) const;
    int add_descriptor(std::shared_ptr<open_file> file);
    int close_descriptor(int fd);
    [[noreturn]] void exit_process(const ending &how);
    // Something changed that a thread may wait for.
    void changed();
    // In a thread: waits until a change or a time. The caller looks again.
    void wait_for_change(time_ns until);
    // In a thread: sleeps; by a clock that stands still in a suspend, or not.
    void sleep_until(time_ns until, bool monotonic);
    void write_log(const char *bytes, std::size_t count);
    void read_log(bool on);  // off: its pipe is full
    bool log_is_read() const { return log_is_read_; }
    // out: the argument of the thread with this name, as of compboxd-loop; nullptr: none
    void *argument_of(const std::string &thread_name) const;
    std::map<std::string, std::string> environment;  // of the next start
    std::function<std::shared_ptr<open_file>(int domain, int type)> make_socket;
    // Of a network interface; 0: there is none.
    std::function<unsigned(const std::string &name)> interface_index = [](const std::string &name) {
        return name == "can0" ? 3U : 0U;
    };
    std::size_t most_descriptors = 1024;
    // Calls on TCP sockets, of all processes: requests that were taken whole, and results that end
    // a connection.
    std::uint64_t tcp_sent = 0, tcp_ended = 0;
    std::uint64_t calls = 0;  // of all kinds, looks at a clock included, of all processes
    // When a call that is not made again was last interrupted.
    time_ns interrupted_ns = -never / 2;
    time_ns hung_up_ns = -never / 2;  // the newest SIGHUP
    time_ns unheard_ns = -never / 2;  // the newest message to systemd that was refused
    bool lacks_thread = false;        // one of this start was refused

    static computer *current;

  private:
    void process_dropped();
    void end_process(const ending &how);
    void close_all(bool by_power_cut);

    dice chance_;
    std::unique_ptr<process> process_;
    time_ns booted_ns_ = 0, suspended_ns_ = 0, suspended_until_ = 0, wall_offset_ns_ = 0;
    std::string boot_id_, line_;
    bool log_is_read_ = true;
    bool dies_ = false;
};

}  // namespace compbox::world
