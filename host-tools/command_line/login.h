// SPDX-License-Identifier: MIT
// Who may reach a program, and the password that others need.
#pragma once

#include <string>

namespace compbox::cli {

// in : a numeric host without brackets, or a name
// out: whether only this computer reaches it
bool is_loopback(const std::string &host);

// out: the first line of the file. Throws input_error for a file that others than its owner and
// group can read or write, and for a password with less than `least_bytes` or more than 128.
std::string read_password(const std::string &path, std::size_t least_bytes);

}  // namespace compbox::cli
