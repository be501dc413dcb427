!> The noise kernels for x86-64-v4 (AVX-512).
module jointfrf_noise_v4
#include "noise.inc"
end module jointfrf_noise_v4
