// The header serves C++: it compiles, links, and std::complex<double> has the layout that the kernel expects.
#include <complex>
#include <vector>

#include "jointfrf.h"

int main()
{
    const jf_int n = 1, n_freq = 2;
    const std::vector<jf_complex> a = {{0.0, 2.0}, {4.0, 0.0}};
    std::vector<jf_complex> a_inverse(2);
    std::vector<jf_int> line_info(2, 7);
    std::vector<double> rcond(2);
    jf_int info = 7;

    jf_invert(&n, &n_freq, a.data(), a_inverse.data(), line_info.data(), rcond.data(), &info);
    const bool good = info == JF_INFO_GOOD && line_info[0] == JF_LINE_GOOD && line_info[1] == JF_LINE_GOOD;
    return good && a_inverse[0] == jf_complex(0.0, -0.5) && a_inverse[1] == jf_complex(0.25, 0.0) ? 0 : 1;
}
