// SPDX-License-Identifier: MIT
// Chooses the model to write, and explains the choice to a person.
#pragma once

#include "host-tools/training/train.h"

namespace compbox::training {

// in : result with both models judged (or the linear one alone)
// out: network_better, chosen, chosen_figures, verdict and warnings.
// The network is better for an output if its residuals on the left-out runs are at least 2 %
// smaller (rms), their worst is not larger on the same rows, and the gain is significant (gain.h).
// If evidence chose the decay, it is better if its evidence is higher.
void decide(train_result &result);

// in : result after decide()
// out: throws input_error if the chosen model leaves more (rms) of an output, on the runs left out,
//      than no compensation would; with options.accept_worse it becomes a warning
void refuse_worse(train_result &result);

}  // namespace compbox::training
