// SPDX-License-Identifier: MIT
#include "host-tools/export/expression.h"

#include <charconv>
#include <cmath>
#include <map>

#include "host-tools/formats/error.h"

namespace compbox::exports {

namespace {

using function = std::function<double(double)>;

// Reading and evaluating recurse with signs, powers and brackets: the length bounds them all.
constexpr std::size_t longest = 1000;

const std::map<std::string, double (*)(double)> &named_functions() {
    static const std::map<std::string, double (*)(double)> all = {
        {"sin", std::sin},   {"cos", std::cos},   {"tan", std::tan},   {"asin", std::asin},
        {"acos", std::acos}, {"atan", std::atan}, {"sqrt", std::sqrt}, {"exp", std::exp},
        {"log", std::log},   {"abs", std::fabs}};
    return all;
}

class parser {
  public:
    parser(const std::string &text, const std::string &variable)
        : text_(text), variable_(variable) {}

    function whole() {
        function result = sum();
        if (next() != '\0') refuse("an operator or the end was expected");
        return result;
    }

  private:
    [[noreturn]] void refuse(const std::string &why) const {
        throw input_error(fmt::format("the formula '{}' cannot be read at character {}: {}", text_,
                                      at_ + 1, why));
    }

    char next() {
        while (at_ < text_.size() && text_[at_] == ' ') ++at_;
        return at_ < text_.size() ? text_[at_] : '\0';
    }

    bool take(char c) {
        if (next() != c) return false;
        ++at_;
        return true;
    }

    function sum() {
        function left = product();
        while (next() == '+' || next() == '-') {
            const double sign = text_[at_++] == '+' ? 1.0 : -1.0;
            left = [left, right = product(), sign](double x) { return left(x) + sign * right(x); };
        }
        return left;
    }

    function product() {
        function left = signed_power();
        while (next() == '*' || next() == '/') {
            const bool times = text_[at_++] == '*';
            left = [left, right = signed_power(), times](double x) {
                return times ? left(x) * right(x) : left(x) / right(x);
            };
        }
        return left;
    }

    function signed_power() {
        if (take('+')) return signed_power();
        if (take('-')) {
            return [inner = signed_power()](double x) { return -inner(x); };
        }
        function base = operand();
        if (!take('^')) return base;
        return
            [base, exponent = signed_power()](double x) { return std::pow(base(x), exponent(x)); };
    }

    // A number, the variable, pi, a bracket or a call; at_ moves behind it. Throws input_error.
    function operand() {
        const char c = next();
        if (take('(')) return bracket();
        if ((c >= '0' && c <= '9') || c == '.') return number();
        std::string name;
        while (at_ < text_.size() &&
               (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) {
            name += text_[at_++];
        }
        if (name == variable_) return [](double x) { return x; };
        if (name == "pi") return [](double) { return M_PI; };
        const auto found = named_functions().find(name);
        if (found == named_functions().end()) {
            at_ -= name.size();
            refuse(name.empty() ? "a number, " + variable_ + " or ( was expected"
                                : "'" + name + "' is neither " + variable_ + " nor a function");
        }
        if (!take('(')) refuse("( was expected");
        return [f = found->second, inner = bracket()](double x) { return f(inner(x)); };
    }

    function bracket() {
        function inner = sum();
        if (!take(')')) refuse(") was expected");
        return inner;
    }

    function number() {
        double value = 0.0;
        const char *begin = text_.data() + at_, *end = text_.data() + text_.size();
        const auto result = std::from_chars(begin, end, value);
        if (result.ec != std::errc()) refuse("this is no number");
        at_ += static_cast<std::size_t>(result.ptr - begin);
        return [value](double) { return value; };
    }

    const std::string &text_, &variable_;
    std::size_t at_ = 0;
};

}  // namespace

function parse_expression(const std::string &text, const std::string &variable) {
    if (text.size() > longest) {
        throw input_error(
            fmt::format("the formula '{}…' has {} characters; write it with at most {}",
                        text.substr(0, 20), text.size(), longest));
    }
    return parser(text, variable).whole();
}

}  // namespace compbox::exports
