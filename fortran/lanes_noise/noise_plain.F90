!> The noise kernels for any processor.
module jointfrf_noise_plain
#include "noise.inc"
end module jointfrf_noise_plain
