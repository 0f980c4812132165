// SPDX-License-Identifier: MIT
// Which of the two models is written, and what a person must know about it.
#pragma once

#include "host-tools/training/train.h"

namespace compbox {

// In : result with both models judged (or the linear one alone)
// Out: network_better, chosen, chosen_figures, verdict and warnings.
// The network is better for an output where it leaves at least 2 % less of the runs left out (rms)
// and not more at worst, on the same rows, and what it saves is clear (gain.h), or, where decay was
// chosen by evidence, where its evidence is higher.
void decide(train_result &result);

}  // namespace compbox
