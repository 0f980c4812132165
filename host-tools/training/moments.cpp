// SPDX-License-Identifier: MIT
#include "host-tools/training/moments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/formats/numbers.h"
#include "host-tools/training/bank.h"
#include "host-tools/training/bank_training.h"

namespace compbox::training {

namespace {

constexpr const char *format_of_moments = "compbox-moments/1";

// out: values from the mean of their run, or of all rows
Eigen::MatrixXd centred(Eigen::MatrixXd values, const std::vector<Eigen::Index> &starts) {
    for (std::size_t k = 0; k < starts.size(); ++k) {
        const Eigen::Index end = k + 1 < starts.size() ? starts[k + 1] : values.rows();
        auto rows = values.middleRows(starts[k], end - starts[k]);
        rows = (rows.rowwise() - rows.colwise().mean()).eval();
    }
    return values;
}

std::string text_of(const std::vector<std::string> &names) {
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ","));
}

}  // namespace

Eigen::Index bank_space::columns() const {
    return static_cast<Eigen::Index>((inputs.size() + 2 * speeds.size()) * (1 + tau_s.size()));
}

std::string bank_space::difference(const bank_space &other) const {
    const auto differ = [](const char *what, const auto &one, const auto &two) {
        return one == two ? std::string()
                          : fmt::format("{} {} and {}", what, text_of(one), text_of(two));
    };
    for (const std::string &text :
         {differ("the outputs", outputs, other.outputs), differ("the inputs", inputs, other.inputs),
          differ("the speeds", speeds, other.speeds)}) {
        if (!text.empty()) return text;
    }
    if (tau_s == other.tau_s) return "";
    return fmt::format("the lags {} and {}, s", fmt::join(tau_s, ","), fmt::join(other.tau_s, ","));
}

json json_of(const bank_space &space) {
    json bank{{"inputs", space.inputs}};
    for (const auto &name : space.speeds) bank["powers"][name] = {1, 2, 3};
    bank["tau_s"] = {0};
    for (const double tau_s : space.tau_s) bank["tau_s"].push_back(formats::short_float(tau_s));
    return {{"outputs", space.outputs}, {"bank", bank}};
}

bank_space space_of(const json &file, const std::string &path) {
    const json bank = formats::member_or_null(file, "bank");
    formats::only_keys(bank, {"inputs", "powers", "tau_s"}, path, "bank");
    bank_space space;
    space.outputs = formats::get<std::vector<std::string>>(file, "outputs", path);
    space.inputs = formats::get<std::vector<std::string>>(bank, "inputs", path);
    space.tau_s = formats::get<std::vector<double>>(bank, "tau_s", path);
    const json powers = formats::member_or_null(bank, "powers");
    for (const auto &name : space.inputs) {
        if (!powers.is_object() || !powers.contains(name)) continue;
        if (powers[name] != json{1, 2, 3}) {
            throw input_error(path, 0, 0, "bank: the powers of {} are not 1, 2, 3", name);
        }
        space.speeds.push_back(name);
    }
    const bool rises = std::is_sorted(space.tau_s.begin(), space.tau_s.end());
    if (space.tau_s.empty() || space.tau_s.front() != 0.0 || !rises) {
        throw input_error(path, 0, 0, "bank: tau_s does not begin with 0 and rise");
    }
    space.tau_s.erase(space.tau_s.begin());
    const bool has_room = !space.inputs.empty() && !space.outputs.empty() &&
                          space.inputs.size() <= most_bank_inputs && space.outputs.size() <= 8 &&
                          space.tau_s.size() <= room_for_lags(space.inputs, space.speeds);
    if (!has_room) throw input_error(path, 0, 0, "is not of a bank that `train` makes");
    return space;
}

json lists_of(const Eigen::MatrixXd &values) {
    json lists = json::array();
    for (Eigen::Index r = 0; r < values.rows(); ++r) {
        json list = json::array();
        for (Eigen::Index c = 0; c < values.cols(); ++c) list.push_back(values(r, c));
        lists.push_back(list);
    }
    return lists;
}

Eigen::MatrixXd matrix_of(const json &file, const char *key, Eigen::Index rows,
                          Eigen::Index columns, const std::string &path) {
    const auto lists = formats::get<std::vector<std::vector<double>>>(file, key, path);
    Eigen::MatrixXd values(rows, columns);
    bool fits = static_cast<Eigen::Index>(lists.size()) == rows;
    for (Eigen::Index r = 0; fits && r < rows; ++r) {
        const auto &list = lists[static_cast<std::size_t>(r)];
        fits = static_cast<Eigen::Index>(list.size()) == columns;
        if (fits) values.row(r) = Eigen::Map<const Eigen::RowVectorXd>(list.data(), columns);
    }
    if (!fits || !values.allFinite()) {
        throw input_error(path, 0, 0, "{}: has not {} times {} finite numbers", key, rows, columns);
    }
    return values;
}

double rows_alike(const Eigen::VectorXd &off, const std::vector<std::size_t> &run) {
    const Eigen::VectorXd from_mean = off.array() - off.mean();
    const double square = from_mean.squaredNorm();
    double alike = 1.0;
    for (std::size_t lag = 1; square > 0.0 && lag < run.size() / 4; ++lag) {
        double products = 0.0;
        for (std::size_t r = lag; r < run.size(); ++r) {
            if (run[r] != run[r - lag]) continue;
            products += from_mean[static_cast<Eigen::Index>(r)] *
                        from_mean[static_cast<Eigen::Index>(r - lag)];
        }
        if (products <= 0.0) break;
        alike += 2.0 * products / square;
    }
    return alike;
}

bank_moments moments_of(const train_result &result) {
    const bool own_offsets = result.options.zero_at_start;
    const auto starts = own_offsets ? starts_of(result.learn.run) : std::vector<Eigen::Index>{0};
    const Eigen::MatrixXd x = centred(result.learn.x, starts), t = centred(result.learn.y, starts);
    const double rows = static_cast<double>(x.rows());
    bank_moments moments;
    moments.space = {result.data.inputs, result.data.speeds, result.data.outputs, result.tau_s};
    moments.xx = x.transpose() * x / rows;
    moments.xt = x.transpose() * t / rows;
    moments.tt = t.colwise().squaredNorm() / rows;
    const Eigen::MatrixXd off = result.linear.left_out_predictions - result.learn.y;
    moments.noise = off.colwise().squaredNorm() / rows;
    const bool twice = result.options.starts_of_lags == lag_starts::both;
    moments.rows.resize(t.cols());
    for (Eigen::Index k = 0; k < t.cols(); ++k) {
        moments.rows[k] = rows / (twice ? 2.0 : 1.0) / rows_alike(off.col(k), result.learn.run);
    }
    return moments;
}

json json_of(const bank_moments &moments) {
    json file = json_of(moments.space);
    file["format"] = format_of_moments;
    file["xx"] = lists_of(moments.xx);
    file["xt"] = lists_of(moments.xt);
    file["tt"] = lists_of(moments.tt.transpose());
    file["noise"] = lists_of(moments.noise.transpose());
    file["rows"] = lists_of(moments.rows.transpose());
    return file;
}

bank_moments read_moments(const std::string &path) {
    const json file = formats::read_json(path);
    if (!file.is_object() || formats::member_or_null(file, "format") != format_of_moments) {
        throw input_error(path, 0, 0, "is no file of `compbox train --moments`");
    }
    formats::only_keys(file, {"format", "outputs", "bank", "xx", "xt", "tt", "noise", "rows"}, path,
                       "");
    bank_moments moments;
    moments.file = path;
    moments.space = space_of(file, path);
    const Eigen::Index columns = moments.space.columns();
    const auto outputs = static_cast<Eigen::Index>(moments.space.outputs.size());
    moments.xx = matrix_of(file, "xx", columns, columns, path);
    moments.xt = matrix_of(file, "xt", columns, outputs, path);
    moments.tt = matrix_of(file, "tt", 1, outputs, path).transpose();
    moments.noise = matrix_of(file, "noise", 1, outputs, path).transpose();
    moments.rows = matrix_of(file, "rows", 1, outputs, path).transpose();
    const bool positive = moments.tt.minCoeff() > 0.0 && moments.noise.minCoeff() > 0.0 &&
                          moments.rows.minCoeff() > 0.0 && moments.xx.diagonal().minCoeff() >= 0.0;
    if (!positive) throw input_error(path, 0, 0, "has squares or rows that are not positive");
    return moments;
}

}  // namespace compbox::training
