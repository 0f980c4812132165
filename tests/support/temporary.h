// SPDX-License-Identifier: MIT
// Files of a test, in a folder of its own, because other test programs may run at the same time.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <stdexcept>
#include <string>

namespace compbox_test {

// A folder of this process, removed at its end; kept for inspection after a failure.
class temporary_folder {
  public:
    temporary_folder() : path_(testing::TempDir() + "compbox-XXXXXX") {
        if (mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no folder " + path_);
    }
    ~temporary_folder() {
        if (testing::UnitTest::GetInstance()->Passed()) std::filesystem::remove_all(path_);
    }
    const std::string &path() const { return path_; }

  private:
    std::string path_;
};

// The path of a file or folder in it. Short: a device's name has 63 characters at most.
inline std::string temporary(const std::string &name) {
    static const temporary_folder folder;
    return folder.path() + "/" + name;
}

}  // namespace compbox_test
