// SPDX-License-Identifier: MIT
// Nothing of its own: the targets that precompile headers for others need one source.
