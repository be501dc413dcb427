!> The noise kernels for x86-64-v3 (AVX2).
module jointfrf_noise_v3
#include "noise.inc"
end module jointfrf_noise_v3
