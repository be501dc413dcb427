!> The noise kernels for x86-64-v2 (SSE4.2).
module jointfrf_noise_v2
#include "noise.inc"
end module jointfrf_noise_v2
