// SPDX-License-Identifier: MIT
#include "host-tools/command_line/login.h"

#include <sys/stat.h>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox::cli {

namespace {

constexpr std::size_t most_bytes = 128;

}  // namespace

bool is_loopback(const std::string &host) {
    return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

std::string read_password(const std::string &path, std::size_t least_bytes) {
    struct stat status = {};
    if (::stat(path.c_str(), &status) == 0 && (status.st_mode & 0007) != 0) {
        throw input_error(path, 0, 0, "other users can read it: chmod o= {}", path);
    }
    const std::string text = formats::read_file(path, 4096);
    const std::string password = text.substr(0, text.find_first_of("\r\n"));
    if (password.size() < least_bytes || password.size() > most_bytes) {
        throw input_error(path, 1, 0, "the password needs {} to {} bytes", least_bytes, most_bytes);
    }
    return password;
}

}  // namespace compbox::cli
