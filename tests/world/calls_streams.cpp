// SPDX-License-Identifier: MIT
// Streams of stdio, for the few calls that the daemon makes. They are the world's own, because a
// buffer of libc would survive a kill and hide the writes from the faults.
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <string>

#include "tests/world/calls.h"

extern "C" {
ssize_t world_write(int fd, const void *from, size_t count);
int world_close(int fd);
}

namespace {

using namespace compbox::world;

constexpr std::size_t buffer_bytes = 4096;

struct stream {
    int fd;
    bool buffered;
    bool failed;
    std::size_t used;
    char buffer[buffer_bytes];
};

stream out = {1, false, false, 0, {}}, err = {2, false, false, 0, {}};

bool write_all(stream &to, const char *bytes, std::size_t count) {
    while (count > 0) {
        const ssize_t done = world_write(to.fd, bytes, count);
        if (done < 0) {
            to.failed = true;
            return false;
        }
        bytes += done;
        count -= static_cast<std::size_t>(done);
    }
    return true;
}

bool flush(stream &to) {
    const std::size_t used = to.used;
    to.used = 0;
    return write_all(to, to.buffer, used);
}

bool put(stream &to, const char *bytes, std::size_t count) {
    if (!to.buffered) return write_all(to, bytes, count);
    while (count > 0) {
        const std::size_t part = std::min(count, buffer_bytes - to.used);
        std::memcpy(to.buffer + to.used, bytes, part);
        to.used += part;
        bytes += part;
        count -= part;
        if (to.used == buffer_bytes && !flush(to)) return false;
    }
    return true;
}

}  // namespace

extern "C" {

stream *world_stdout = &out, *world_stderr = &err;

stream *world_fdopen(int fd, const char *) {
    if (here().begin("fdopen").error != 0) return nullptr;
    void *const block = std::malloc(sizeof(stream));
    here().current_process().heap.insert(block);
    return new (block) stream{fd, true, false, 0, {}};
}

int world_fclose(stream *of) {
    const bool flushed = flush(*of);
    const int closed = world_close(of->fd);
    if (here().current_process().heap.erase(of) > 0) std::free(of);
    return flushed && closed == 0 ? 0 : EOF;
}

int world_ferror(stream *of) {
    return of->failed;
}

int world_fputc(int letter, stream *to) {
    const char byte = static_cast<char>(letter);
    return put(*to, &byte, 1) ? letter : EOF;
}

size_t world_fwrite(const void *from, size_t size, size_t count, stream *to) {
    return put(*to, static_cast<const char *>(from), size * count) ? count : 0;
}

int world_puts(const char *text) {
    return put(out, text, std::strlen(text)) && put(out, "\n", 1) ? 1 : EOF;
}

__attribute__((format(printf, 2, 3))) int world_fprintf(stream *to, const char *format, ...) {
    char text[16384];
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0) return -1;
    return put(*to, text, std::min(static_cast<std::size_t>(length), sizeof text - 1)) ? length
                                                                                       : -1;
}
}
