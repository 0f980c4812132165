// SPDX-License-Identifier: MIT
// A formula of one variable, such as a tool path y = k(x): "60 + 0.5*X", "sqrt(100^2 - X^2)".
#pragma once

#include <functional>
#include <string>

namespace compbox::exports {

// in : + - * / ^ ( ), numbers, the variable by its name, pi, and sin cos tan asin acos atan sqrt
// exp log abs of one argument; angles in radians
// out: the function; NaN where it is undefined, as for the root of a negative number
// Throws input_error with the position of the first invalid character.
std::function<double(double)> parse_expression(const std::string &text,
                                               const std::string &variable);

}  // namespace compbox::exports
