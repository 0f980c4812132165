// SPDX-License-Identifier: MIT
#include "tests/world/computer.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "tests/world/daemon_image.h"
#include "tests/world/devices.h"

namespace compbox::world {

computer *computer::current = nullptr;

computer::computer(scheduler &of_world, std::uint64_t seed)
    : time(of_world), files([this] { return wall(); }), chance_(seed, "computer") {
    current = this;
    lines_left = 0;
    wall_offset_ns_ = 1700000000 * second + chance_.time_between(0, 300000000 * second);
    time.dropped = [this] { process_dropped(); };
    for (const char *folder :
         {"/dev", "/etc", "/etc/compbox", "/var", "/var/lib", "/var/lib/compbox",
          "/var/lib/compbox/blackbox", "/run", "/proc", "/sys"})
        files.make_folder(folder);
    add_system_devices(*this);
}

computer::~computer() {
    time.drop_threads();
    process_.reset();
    current = nullptr;
}

void computer::boot() {
    booted_ns_ = time.now() - static_cast<time_ns>(chance_.log_between(2e9, 1000e9));
    suspended_ns_ = suspended_until_ = 0;
    char id[40];
    std::snprintf(id, sizeof id, "%016llx-%016llx", static_cast<unsigned long long>(chance_.next()),
                  static_cast<unsigned long long>(chance_.next()));
    boot_id_ = id;
}

void computer::start_daemon(const std::vector<std::string> &arguments) {
    reset_daemon_image();
    process_ = std::make_unique<process>();
    process_->arguments = arguments;
    process_->environment = environment;
    for (auto &word : process_->arguments) process_->argv.push_back(word.data());
    process_->argv.push_back(nullptr);
    for (int fd = 0; fd < 3; ++fd) process_->descriptors.push_back(make_terminal(*this, fd));
    thread &first = time.start("compboxd", [this] {
        const int code =
            compboxd_main(static_cast<int>(process_->arguments.size()), process_->argv.data());
        exit_process({false, code, false});
    });
    (void)first;
}

call_fate computer::begin(const char *name, const open_file *file, const char *path) {
    ++calls;
    const std::uint64_t bits = chance_.next();
    time.pass(1 * us + static_cast<time_ns>(bits & 0xFFF));  // up to 5 µs
    call_fate fate;
    if (faults != nullptr) {
        fate = faults->at_call({name, file,
                                path != nullptr   ? path
                                : file != nullptr ? file->path.c_str()
                                                  : ""});
        if (fate.delay_ns > 0) time.pass(fate.delay_ns);
        while (fate.is_on_disk && time.now() < files.hangs_until_ns)
            time.pass(std::min(files.hangs_until_ns - time.now(), 100 * ms));
    }
    if (fate.error != 0) time.running()->error_number = fate.error;
    return fate;
}

void computer::preempt() {
    if (time.running() == nullptr || faults == nullptr) return;
    const int error_number = time.running()->error_number;
    const preemption drawn = faults->between_lines();
    lines_left = drawn.lines;
    if (drawn.duration_ns > 0) time.pass(drawn.duration_ns);
    time.running()->error_number = error_number;
}

std::shared_ptr<open_file> computer::descriptor(int fd) const {
    const auto &all = process_->descriptors;
    if (fd < 0 || static_cast<std::size_t>(fd) >= all.size()) return nullptr;
    return all[static_cast<std::size_t>(fd)];
}

int computer::add_descriptor(std::shared_ptr<open_file> file) {
    auto &all = process_->descriptors;
    for (std::size_t fd = 0; fd < all.size(); ++fd) {
        if (all[fd] != nullptr) continue;
        all[fd] = std::move(file);
        return static_cast<int>(fd);
    }
    if (all.size() >= most_descriptors) return -EMFILE;
    all.push_back(std::move(file));
    return static_cast<int>(all.size()) - 1;
}

int computer::close_descriptor(int fd) {
    const auto file = descriptor(fd);
    if (file == nullptr) return -EBADF;
    process_->descriptors[static_cast<std::size_t>(fd)] = nullptr;
    file->closed(false);
    return 0;
}

void computer::changed() {
    for (const auto &one : time.threads()) {
        if (one->waits_for_change) time.wake(*one);
    }
}

void computer::wait_for_change(time_ns until) {
    thread &self = *time.running();
    self.waits_for_change = true;
    time.wait(until);
    self.waits_for_change = false;
}

void computer::sleep_until(time_ns until, bool monotonic) {
    thread &self = *time.running();
    self.stands_in_suspend = monotonic;
    time.wait(until);
    self.stands_in_suspend = false;
}

void computer::write_log(const char *bytes, std::size_t count) {
    hash.add(bytes, count);
    for (std::size_t i = 0; i < count; ++i) {
        if (bytes[i] != '\n') {
            line_ += bytes[i];
            continue;
        }
        if (logged) logged(line_);
        line_.clear();
    }
}

void computer::read_log(bool on) {
    log_is_read_ = on;
    if (process_ != nullptr) changed();
}

void *computer::argument_of(const std::string &thread_name) const {
    for (const auto &one : time.threads()) {
        if (one->name == thread_name) return one->argument;
    }
    return nullptr;
}

// ---- the end of the process

void computer::end_process(const ending &how) {
    if (process_ == nullptr || process_->over) return;
    process_->over = true;
    process_->how = how;
    if (time.running() != nullptr) time.end_all_here();
    time.drop_threads();
    process_dropped();
}

void computer::exit_process(const ending &how) {
    end_process(how);
    std::abort();  // end_process does not return in a thread
}

void computer::process_dropped() {
    if (process_ == nullptr) return;
    const auto gone = std::move(process_);
    for (auto &file : gone->descriptors) {
        if (file != nullptr && !gone->how.power_cut) file->closed(true);
        file = nullptr;
    }
    for (void *block : gone->heap) std::free(block);
    if (gone->how.power_cut) files.cut_power(chance_);
    hash.add(static_cast<std::int64_t>(gone->how.code));
    line_.clear();
    if (ended) ended(gone->how);
}

void computer::send_signal(int number) {
    if (number == SIGHUP) hung_up_ns = time.now();
    if (process_ == nullptr || process_->over) return;
    if (number == SIGKILL) {
        end_process({true, number, false});
        return;
    }
    if (process_->ignored.count(number) > 0) return;
    bool blocked = true;
    for (const auto &one : time.threads()) blocked = blocked && (one->mask >> number & 1) != 0;
    if (!blocked) {
        end_process({true, number, false});
        return;
    }
    process_->pending |= std::uint64_t{1} << number;
    changed();
}

void computer::cut_power() {
    end_process({true, SIGKILL, true});
}

void computer::set_wall_clock(time_ns step) {
    constexpr time_ns most = 7258118400 * second;
    if (wall() + step < 0 || wall() + step > most) return;
    wall_offset_ns_ += step;
}

void computer::skip(time_ns duration) {
    booted_ns_ -= duration;
    suspended_ns_ += duration;
    wall_offset_ns_ += duration;
}

void computer::suspend(time_ns duration) {
    if (time.now() < suspended_until_) return;
    const time_ns until = suspended_until_ = time.now() + duration;
    suspended_ns_ += duration;
    time.shift_sleepers([&](const thread &one) {
        if (one.wake_ns == never) return never;
        return one.stands_in_suspend ? one.wake_ns + duration : one.wake_ns;
    });
    for (const auto &one : time.threads()) time.hold(*one, until);
}

void computer::end_suspend() {
    const time_ns now = time.now(), rest = suspended_until_ - now;
    if (rest <= 0) return;
    suspended_until_ = now;
    suspended_ns_ -= rest;
    time.shift_sleepers([&](const thread &one) {
        if (one.wake_ns == never || !one.stands_in_suspend) return one.wake_ns;
        return std::max(now, one.wake_ns - rest);
    });
}

}  // namespace compbox::world
