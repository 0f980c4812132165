// SPDX-License-Identifier: MIT
#include "host-tools/formats/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <ostream>
#include <set>
#include <system_error>
#include <utility>

#include "host-tools/formats/error.h"

namespace compbox::formats {

namespace {

// The input files of this program: files that it read and had not written. Thread-safe.
class given_files {
  public:
    void note_read(const std::string &path) {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto file = identity_of(path);
        if (made_.count(file) == 0) read_.insert(file);
    }
    void note_written(const std::string &path) {
        const std::lock_guard<std::mutex> lock(mutex_);
        const auto file = identity_of(path);
        made_.insert(file);
        read_.erase(file);  // an inode that a rename freed may be used again
    }
    bool hold(const std::string &path) {
        const std::lock_guard<std::mutex> lock(mutex_);
        return read_.count(identity_of(path)) > 0;
    }

  private:
    using identity = std::pair<dev_t, ino_t>;
    static identity identity_of(const std::string &path) {
        struct stat status = {};
        return ::stat(path.c_str(), &status) == 0 ? identity(status.st_dev, status.st_ino)
                                                  : identity();
    }
    std::mutex mutex_;
    std::set<identity> read_, made_;
};

given_files &given() {
    static given_files files;
    return files;
}

// folders of writes_below; empty: no limit
std::vector<std::filesystem::path> &allowed_folders() {
    static std::vector<std::filesystem::path> folders;
    return folders;
}

// out: the absolute path; links and dots of its existing part are resolved
std::filesystem::path real_path(const std::string &path) {
    std::error_code error;
    const auto real = std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
    if (error) throw input_error(path, 0, 0, "cannot be resolved ({})", error.message());
    return real.has_filename() ? real : real.parent_path();
}

bool is_in_or_below(const std::filesystem::path &path, const std::filesystem::path &folder) {
    const auto parts = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
    return parts.first == folder.end();
}

[[noreturn]] void fail(const std::string &path, const std::string &doing) {
    throw input_error(path, 0, 0, "cannot {} ({})", doing, std::strerror(errno));
}

// Writes all of content to fd and syncs it; false with errno set on failure.
bool write_all(int fd, const std::string &content) {
    std::size_t done = 0;
    while (done < content.size()) {
        const ssize_t n = ::write(fd, content.data() + done, content.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return false;
        done += static_cast<std::size_t>(n);
    }
    return ::fsync(fd) == 0;
}

void sync_folder_of(const std::string &path) {
    const auto parent = std::filesystem::path(path).parent_path();
    const int fd =
        ::open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    ::fsync(fd);
    ::close(fd);
}

constexpr mode_t readable_by_all = 0644, readable_by_owner = 0600;

// in : any path. Throws input_error if it is empty, forbidden by writes_below, not a regular file,
// or not writable; an existing file is then unchanged.
void replace_file(const std::string &path, const std::string &content,
                  mode_t mode = readable_by_all) {
    if (path.empty()) throw input_error("the name of the file to write is empty");
    refuse_outside(path);
    std::error_code error;
    if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
        throw input_error(path, 0, 0, "is not a regular file, so it is not written over");
    }
    std::string temporary = path + ".tmp-XXXXXX";
    const int fd = ::mkostemp(temporary.data(), O_CLOEXEC);
    if (fd < 0) fail(path, "create a file there");
    ::fchmod(fd, mode);
    const bool written = write_all(fd, content);
    const int saved = errno;
    const bool closed = ::close(fd) == 0;
    if (!written || !closed || ::rename(temporary.c_str(), path.c_str()) != 0) {
        if (!written) errno = saved;
        const int reason = errno;
        ::unlink(temporary.c_str());
        errno = reason;
        fail(path, "write the file");
    }
    given().note_written(path);
    sync_folder_of(path);
}

}  // namespace

std::string read_file(const std::string &path, std::size_t max_bytes) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) {
        throw input_error(path, 0, 0, "is a folder, not a file");
    }
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in) fail(path, "open the file");
    std::string content;
    char block[65536];
    while (in.read(block, sizeof block) || in.gcount() > 0) {
        content.append(block, static_cast<std::size_t>(in.gcount()));
        if (content.size() > max_bytes) {
            throw input_error(path, 0, 0, "is larger than {} bytes", max_bytes);
        }
    }
    if (in.bad()) fail(path, "read the file");
    given().note_read(path);
    return content;
}

void refuse_given(const std::string &path, const std::string &what) {
    std::error_code error;
    if (std::filesystem::is_regular_file(path, error) && given().hold(path)) {
        throw input_error(path, 0, 0, "was read by this very command: give {} another name", what);
    }
}

void write_file(const std::string &path, const std::string &content, std::ostream *out) {
    refuse_given(path, "what it writes");
    update_file(path, content, out);
}

void update_file(const std::string &path, const std::string &content, std::ostream *out) {
    if (out != nullptr && (path == "-" || path == "/dev/stdout")) {
        if (!(*out << content << std::flush)) fail(path, "write");
    } else {
        replace_file(path, content);
    }
}

void write_secret_file(const std::string &path, const std::string &content) {
    refuse_given(path, "what it writes");
    replace_file(path, content, readable_by_owner);
}

writes_below::writes_below(const std::vector<std::string> &folders) {
    for (const auto &folder : folders) allowed_folders().push_back(real_path(folder));
}

writes_below::~writes_below() {
    allowed_folders().clear();
}

void refuse_outside(const std::string &path) {
    const auto &folders = allowed_folders();
    if (folders.empty()) return;
    const auto real = real_path(path);
    for (const auto &folder : folders) {
        if (is_in_or_below(real, folder)) return;
    }
    throw input_error(path, 0, 0,
                      "is outside the scenario's folder and the folder of the run (-o), and is not "
                      "written");
}

void make_folder(const std::string &path) {
    refuse_outside(path);
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error) throw input_error(path, 0, 0, "cannot create the folder ({})", error.message());
}

}  // namespace compbox::formats
