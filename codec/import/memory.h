// SPDX-License-Identifier: GPL-3.0-or-later
// How the C library (glibc; elsewhere nothing happens) keeps the memory of programs that encode and decode meshes. It
// allocates nothing.
#pragma once

namespace pmcd::import {

/// For the start of main(): large blocks that are freed go back to the system at once. Meshes are built of a few
/// growing arrays; kept, what one frees would not fit the next, and the peak would rise by an eighth.
void return_large_blocks();

}  // namespace pmcd::import
