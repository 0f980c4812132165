// SPDX-License-Identifier: MIT
// A coefficient file as functions of its signals: the box's own terms, without time, limits and
// registers.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "host-tools/formats/json.h"

struct cb_config;

namespace compbox::exports {

class channel_model {
  public:
    // Loads the file with the box's loader. Throws input_error.
    explicit channel_model(const std::string &path);
    ~channel_model();

    const std::string &path() const { return path_; }
    const cb_config &config() const { return *config_; }
    const json &file() const { return json_; }

    // Values of all signals, by the file's order.
    using values = std::vector<double>;

    // The middle of each signal's plausible range; lags have their signal's value, squared where
    // they follow the square.
    values middle() const;
    // Sets a signal and the lags that follow it. The signal must not be a lag.
    void set(values &at, unsigned signal, double value) const;
    // Index of a signal. Throws input_error naming the signals that are there.
    unsigned signal(const std::string &name) const;

    // out: all term outputs in steady state; µm, µrad. in : direction of all axes for curves with
    // branches: forward (1), backward (-1), or unknown (0: the mean)
    std::vector<double> outputs(const values &at, int direction = 0) const;
    // out: whether a channel, or its part from a signal, has curves with branches
    bool has_branches(unsigned channel, unsigned signal) const;
    // out: displacement of a channel: minus the sum of its outputs, µm
    double wanted_um(unsigned channel, const values &at) const;

    // out: the measured signals on which an output depends, directly or through others
    const std::set<unsigned> &dependencies(unsigned output) const { return depends_[output]; }
    // A position of an axis: unit mm or deg, and not the length of the tool.
    bool is_position(unsigned signal) const;

  private:
    std::string path_;
    json json_;
    std::unique_ptr<cb_config> config_;
    std::vector<std::set<unsigned>> depends_;
};

}  // namespace compbox::exports
