// SPDX-License-Identifier: MIT
#include "host-tools/compbox/line_sigma.h"

#include <fmt/core.h>

#include "host-tools/command_line/option_checks.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/text.h"

namespace compbox {

void add_line_sigma(cli::command &command, std::vector<double> &sigma_um,
                    const std::string &description) {
    const auto take = [&sigma_um](const std::string &text) {
        for (const auto &piece : formats::split(text, ',')) sigma_um.push_back(std::stod(piece));
    };
    const auto fault = [](const std::string &text) {
        for (const auto &piece : formats::split(text, ',')) {
            const std::string sentence = cli::above_zero()(piece);
            if (!sentence.empty()) return sentence;
        }
        return std::string();
    };
    command.add_option_function("--sigma-um S|ALONG,ACROSS", take, description).check(fault);
}

identification::line_sigma line_sigma_of(const std::vector<double> &sigma_um, int axis,
                                         std::size_t points) {
    if (sigma_um.size() <= 2) {
        return identification::sigma_of_lines(sigma_um.front(), sigma_um.back(), axis, points);
    }
    if (sigma_um.size() != 3 * points) {
        throw cli::usage_error(
            "--sigma-um", fmt::format("needs one number, two (along the axis and across it) or one "
                                      "for each of the {} lines, not {}",
                                      3 * points, sigma_um.size()));
    }
    return Eigen::Map<const Eigen::VectorXd>(sigma_um.data(),
                                             static_cast<Eigen::Index>(sigma_um.size()));
}

json line_sigma_json(const identification::line_sigma &sigma_um) {
    if ((sigma_um.array() == sigma_um(0)).all()) return sigma_um(0);
    json all = json::array();
    for (const double sigma : sigma_um) all.push_back(sigma);
    return all;
}

}  // namespace compbox
