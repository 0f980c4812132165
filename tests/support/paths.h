// SPDX-License-Identifier: MIT
// Where tests find examples, documents and programs. paths.cpp alone is compiled for one folder, so
// that a clone in another one finds the objects of all tests in ccache.
#pragma once

#include <string>

/// The file `below` of the sources: from_source("docs/faults.md").
std::string from_source(const std::string &below);

/// The program `name` of this build.
std::string built(const std::string &name);
