// SPDX-License-Identifier: MIT
#include "host-tools/box_files/followed_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

namespace compbox::box_files {

followed_file::~followed_file() {
    close();
}

void followed_file::close() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
}

void followed_file::begin(const reader &to) {
    position_ = to.begin ? to.begin(descriptor_) : 0;
    lines_.clear();
}

bool followed_file::open(const reader &to) {
    struct stat status = {};
    descriptor_ = ::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor_ < 0) return false;
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
        close();
        return false;
    }
    begin(to);
    return true;
}

// out: another file has the name now
bool followed_file::is_renamed() const {
    struct stat named = {}, opened = {};
    if (::stat(path_.c_str(), &named) != 0 || ::fstat(descriptor_, &opened) != 0) return false;
    return named.st_ino != opened.st_ino || named.st_dev != opened.st_dev;
}

// out: number of bytes, 0 at the end
std::size_t followed_file::read_once(std::size_t most_bytes, const reader &to) {
    char bytes[65536];
    const ssize_t got = ::pread(descriptor_, bytes, std::min(most_bytes, sizeof bytes),
                                static_cast<off_t>(position_));
    if (got <= 0) return 0;
    position_ += static_cast<std::size_t>(got);
    lines_.add(std::string_view(bytes, static_cast<std::size_t>(got)), to.line);
    return static_cast<std::size_t>(got);
}

bool followed_file::poll(std::size_t most_bytes, const reader &to) {
    if (descriptor_ < 0 && !open(to)) return true;
    // Before the reading: what was appended before the renaming is read.
    const bool renamed = is_renamed();
    struct stat status = {};
    if (::fstat(descriptor_, &status) == 0 &&
        static_cast<std::size_t>(status.st_size) < position_) {
        begin(to);  // emptied
    }
    while (most_bytes > 0) {
        const std::size_t got = read_once(most_bytes, to);
        most_bytes -= got;
        if (got > 0) continue;
        if (!renamed) return true;
        close();
        return open(to) ? poll(most_bytes, to) : true;
    }
    return false;
}

}  // namespace compbox::box_files
