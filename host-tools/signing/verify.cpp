// SPDX-License-Identifier: MIT
#include "host-tools/signing/verify.h"

#include "host-tools/formats/error.h"

extern "C" {
#include "hal/linux/enrolled.h"
}

namespace compbox::signing {

const std::string suffix = CB_SIGNATURE_SUFFIX;

std::string signer_of(const std::string &path, const std::string &bytes, const std::string &keys) {
    char message[1024] = "";
    const cb_enrolled verdict = cb_enrolled_judge(keys.c_str(), path.c_str(), bytes.data(),
                                                  bytes.size(), message, sizeof message);
    if (verdict == CB_ENROLLED_REFUSED) throw input_error(message);
    if (verdict == CB_ENROLLED_NONE) {
        throw input_error(keys, 0, 0, "has no key NAME.pub to verify the signature with");
    }
    return message;
}

}  // namespace compbox::signing
