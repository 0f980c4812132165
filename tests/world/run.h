// SPDX-License-Identifier: MIT
// One run of the world: a seed, its machine, the daemon from start to end. The same seed, cycles
// and faults give the same bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "host-tools/fakeplc/pt100.h"
#include "tests/world/can_bus.h"
#include "tests/world/computer.h"
#include "tests/world/faults.h"
#include "tests/world/invariants.h"
#include "tests/world/machine.h"
#include "tests/world/network.h"
#include "tests/world/person.h"
#include "tests/world/plc_side.h"
#include "tests/world/serial_line.h"
#include "tests/world/signing.h"

namespace compbox::world {

struct run_options {
    std::uint64_t seed = 1, cycles = 1000;
    fault_set faults;
    fault_limits most;                        // occurrences of a kind; without an entry any number
    bool prints_log = false;                  // of the daemon, to stdout
    bool prints_exchanges = false;            // with the PLC, to stdout
    std::function<void(run &)> prepare = {};  // called before the start, for tests
};

struct violation {
    std::string invariant, words;
    time_ns at = 0;
    std::uint64_t cycle = 0;
    std::vector<std::string> last_faults;
};

struct run_result {
    std::uint64_t cycles = 0, hash = 0, faults = 0, starts = 0;
    time_ns duration = 0;
    std::vector<violation> violations;  // at most one: the run ends there
};

class run {
  public:
    explicit run(const run_options &with);
    run_result go();

    const run_options options;
    scheduler time;
    machine box_machine;
    computer box;
    network net;
    plc_side plc;
    std::unique_ptr<serial_line> plc_line, bus_line;  // null: the machine has none
    std::unique_ptr<can_bus> can;
    std::unique_ptr<person> measurer;
    fault_injector faults;

    bool asked_to_stop = false;  // SIGTERM, or --cycles
    std::uint64_t cycles = 0;

    // ---- for faults
    // Starts the daemon again: after `pause`, as systemd does after an end that nobody asked for.
    void restart_after(time_ns pause);
    // SIGTERM; when the daemon has ended, it starts again.
    void stop_daemon();
    std::uint64_t starts() const { return result_.starts; }
    unsigned revision = 1;                     // of the newest coefficient file
    std::string good_file;                     // newest that the daemon should take
    time_ns replaced_in_read_ns = -never / 2;  // the newest file came while another was read
    // Call it with each file that comes to config_path: invariants ask running() for its limits.
    void note_file(const std::string &text);
    // Of a file that has another one than all before: invariants know files by their revision.
    unsigned next_revision();
    // Another file of this revision was noted.
    bool knows_revision_of(const std::string &text);
    // out: what a file that was noted promises; nullptr: it was not
    const machine *file_of(const std::string &text);
    // out: the newest file of this revision; nullptr: none that a box can run
    const machine *with_revision(unsigned revision) const;
    std::string first_file() const;
    std::string good_file_of(unsigned revision);
    std::set<unsigned> wrong_revisions;  // of files that no box takes
    // Of machines whose box knows a key.
    const std::optional<file_signer> signer;
    // Signs what comes to config_path, before it comes.
    void sign(const std::string &text);
    void put_signed(const std::string &text);  // both, in the place of the file before
    // out: after so long with enable off all outputs of this file's box are zero
    static time_ns rest_ns(const machine &by);
    // Likewise of this run's box in its quiet end, where a file that goes to zero for hours is
    // gone.
    time_ns rest_ns();
    static constexpr const char *config_path = "/etc/compbox/coefficients.json";
    static constexpr const char *signature_path = "/etc/compbox/coefficients.json.minisig";
    static constexpr const char *new_signature_path = "/etc/compbox/coefficients.json.minisig.new";
    static constexpr const char *keys_path = "/etc/compbox/keys";
    static constexpr const char *state_path = "/var/lib/compbox/state";
    static constexpr const char *stats_path = "/run/stats.json";
    static constexpr const char *snapshot_path = "/run/snapshot.json";
    static constexpr const char *events_path = "/var/lib/compbox/events";
    static constexpr const char *record_path = "/run/record.csv";
    static constexpr const char *inputs_path = "/run/inputs";
    static constexpr const char *victim_path = "/run/elsewhere";  // links name it
    static constexpr const char *blackbox_path = "/var/lib/compbox/blackbox";
    std::vector<double> requests_s;                    // of files of the black box
    static constexpr std::size_t blackbox_files = 99;  // at most (docs/record.md)
    static constexpr int old_records = 7;  // that fill_records() puts there, of so many bytes
    static constexpr std::size_t old_record_bytes = 95000;
    static constexpr std::size_t unlimited_record_bytes = 1500000;
    static constexpr std::size_t most_record_bytes = 200000;   // of one with a limit, and more
    static constexpr const char *unfinished = ".new";          // behind the name of a file
    static constexpr std::size_t most_events_bytes = 1000000;  // of one file (docs/events.md)
    static constexpr time_ns systemd_waits = 10 * second;      // its WATCHDOG_USEC
    static constexpr time_ns watchdog_waits = 10 * second;     // the hardware (docs/compboxd.md)
    time_ns ticked_ns() const { return ticked_ns_; }           // when the newest cycle began
    bool records_each_cycle() const { return options.seed % 16 != 4; }  // or a row in 500 ms
    bool ticks_by_boottime() const { return options.seed % 5 == 0; }
    time_ns clock_of_loop() const { return ticks_by_boottime() ? box.boottime() : box.monotonic(); }
    bool has_watchdog() const { return options.seed % 3 == 0; }
    // Files are kept more often where the faults of the run act on them.
    bool keeps_events() const { return options.seed % 2 == 1 || files_suffer_; }
    bool keeps_record() const;
    bool keeps_snapshot() const;
    bool keeps_slow_snapshot() const { return options.seed % 6 == 1; }  // one a second
    bool keeps_inputs() const;
    bool keeps_blackbox() const;
    // Whether all records together have at most 1 MB.
    bool limits_records() const { return options.seed % 8 == 0; }
    const std::optional<site_ceiling> &ceiling() const { return ceiling_; }  // of its command line

    // ---- for invariants
    // What the file promises that the daemon ran when it sent a request.
    const machine &running_at(time_ns sent) const;
    // What the file promises by which the box computed the block that a request writes: with FC23
    // the step before it has, so behind a reload still that of the file before.
    const machine &author_of(const exchange &seen) const;
    const machine &running() const { return running_at(time.now()); }
    std::size_t files_taken() const { return taken_.size(); }
    bool stop_asked = false;      // SIGTERM was sent to this daemon
    bool has_statistics = false;  // this daemon has written some
    time_ns longest_gap_ns = 0;   // between two ticks of this daemon
    std::uint64_t cycles_of_daemon = 0;
    std::uint64_t steps_of_daemon = 0;  // cycles that ended; a wait that ends late is repeated
    time_ns flipped_ns = never;  // a bit that each step of this daemon checks flipped then …
    std::uint64_t flipped_at_step = ~std::uint64_t{0};  // … or one anywhere, behind so many steps
    // Once faults have ended, the box is ACTIVE after at most this time.
    time_ns recovery_ns();
    void report(const char *invariant, const std::string &words);

  private:
    void connect_wires();
    bool is_probe(const fakeplc::byte_string &frame) const;
    bool is_of_read_block(const fakeplc::byte_string &frame) const;
    void wander_modules();
    void plan_request();
    void fill_blackbox();
    void fill_events();
    void fill_records();
    void fill_temporaries();
    void note_report(const std::string &path, const std::string &text);
    std::map<std::size_t, std::string> thermometers_in(int unit, std::size_t start,
                                                       std::size_t count) const;
    rtu_slaves::reply answer_module(int unit, const fakeplc::byte_string &request);
    std::shared_ptr<open_file> make_socket(int domain);
    void start_daemon();
    void daemon_ended(const ending &how);
    void count_tick();
    std::uint64_t quiet_cycles();  // of the box in recovery_ns()
    void ask_to_stop();
    void end_faults();
    void heed(const std::string &line);
    void follow_file();
    void note_exchange(time_ns sent, const fakeplc::byte_string &request,
                       const fakeplc::byte_string &reply, time_ns duration);
    void print_exchange(const exchange &seen) const;
    template <typename Call>
    void each(Call call) {
        for (auto &one : invariants_) call(*one);
    }

    std::unique_ptr<rtu_slaves> plc_slave_, bus_slaves_;
    fakeplc::pt100_modules modules_;
    std::vector<std::unique_ptr<invariant>> invariants_;
    bool files_suffer_ = false;  // from the faults of the run
    const std::optional<machine> &facts_in(const std::string &text);
    std::pair<std::string, std::optional<machine>> newest_facts_;
    std::map<unsigned, machine> files_;  // by revision, of those that a box can run
    struct taken_file {
        time_ns at;
        unsigned revision;
    };
    const machine &file_at(const std::vector<taken_file> &files, time_ns sent) const;
    std::vector<taken_file> taken_;     // by the box
    std::vector<taken_file> combined_;  // the files behind what FC23 writes since then
    unsigned stepping_ = 1;             // revision of the file of the step before this tick
    bool runs_first_file_ = false;      // of this daemon
    std::uint32_t generation_ = 0;      // of the file that runs: one may come again
    time_ns ticked_ns_ = 0;
    std::optional<site_ceiling> ceiling_;
    std::uint64_t signatures_ = 0;
    std::uint64_t quiet_ = 0;  // cycles without faults, behind those of the options
    run_result result_;
    dice chance_, requests_;
};

}  // namespace compbox::world
