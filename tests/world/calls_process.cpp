// SPDX-License-Identifier: MIT
// The process: its end, its environment, its memory, its signals.
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "tests/world/calls.h"

namespace {

using namespace compbox::world;

// Bit N for signal N, by the layout of glibc, where it is bit N - 1.
std::uint64_t bits_of(const sigset_t *set) {
    std::uint64_t bits;
    static_assert(sizeof *set >= sizeof bits);
    std::memcpy(&bits, set, sizeof bits);
    return bits << 1;
}

void set_from(sigset_t *set, std::uint64_t bits) {
    sigemptyset(set);
    for (int number = 1; number < 32; ++number) {
        if (bits >> number & 1) sigaddset(set, number);
    }
}

char program_name[] = "compboxd";

}  // namespace

extern "C" {

char *world_program_invocation_short_name = program_name;

void world__exit(int code) {
    (void)here().begin("_exit");
    here().exit_process({false, code, false});
}

void world_abort() {
    here().exit_process({true, SIGABRT, false});
}

void *world_calloc(size_t count, size_t size) {
    if (here().begin("calloc").error != 0) return nullptr;
    void *const block = std::calloc(count, size);
    here().current_process().heap.insert(block);
    return block;
}

void world_free(void *block) {
    if (here().current_process().heap.erase(block) > 0) std::free(block);
}

char *world_getenv(const char *name) {
    auto &all = here().current_process().environment;
    const auto found = all.find(name);
    return found == all.end() ? nullptr : found->second.data();
}

int world_unsetenv(const char *name) {
    here().current_process().environment.erase(name);
    return 0;
}

uid_t world_geteuid() {
    return 1000;  // who owns every file
}

pid_t world_getpid() {
    return 4711;
}

int world_mlockall(int) {
    return here().begin("mlockall").error != 0 ? -1 : 0;
}

long world_sysconf(int name) {
    return name == _SC_PAGESIZE ? 4096 : name == _SC_NPROCESSORS_CONF ? 2 : -1;
}

int world_prctl(int option, ...) {
    va_list arguments;
    va_start(arguments, option);
    if (option == PR_SET_NAME) here().time.running()->name = va_arg(arguments, const char *);
    va_end(arguments);
    return 0;
}

int world_pthread_sigmask(int how, const sigset_t *set, sigset_t *before) {
    std::uint64_t &mask = here().time.running()->mask;
    if (before != nullptr) set_from(before, mask);
    if (set == nullptr) return 0;
    const std::uint64_t bits = bits_of(set);
    mask = how == SIG_BLOCK ? mask | bits : how == SIG_UNBLOCK ? mask & ~bits : bits;
    return 0;
}

sighandler_t world_signal(int number, sighandler_t handler) {
    if (handler == SIG_IGN) here().current_process().ignored.insert(number);
    return SIG_DFL;
}

// The lowest pending signal of the set, or EAGAIN after the time.
int world_sigtimedwait(const sigset_t *set, siginfo_t *info, const timespec *wait) {
    if (here().begin("sigtimedwait").error != 0) return -1;
    const std::uint64_t wanted = bits_of(set);
    const time_ns until = here().time.now() + wait->tv_sec * second + wait->tv_nsec;
    for (;;) {
        std::uint64_t &pending = here().current_process().pending;
        if (const std::uint64_t found = pending & wanted; found != 0) {
            const int number = __builtin_ctzll(found);
            pending &= ~(std::uint64_t{1} << number);
            if (info != nullptr) {
                info->si_pid = 1;  // systemd, as root
                info->si_uid = 0;
            }
            return number;
        }
        if (here().time.now() >= until) break;
        here().wait_for_change(until);
    }
    error_number() = EAGAIN;
    return -1;
}
}
