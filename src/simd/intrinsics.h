/// @file The intrinsics of the processor, of which the vector vocabulary is made. Reading them takes longer
/// than compiling most loops, so they are among the precompiled headers.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif
