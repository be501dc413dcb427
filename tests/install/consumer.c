/* A program that knows jointfrf only as installed: the inverse of 2, and a line that is singular. */
#include <jointfrf.h>

int main(void)
{
    const jf_int n = 1, n_freq = 2, engine = JF_ENGINE_LAPACK;
    jf_complex a[2] = {2.0, 0.0}, a_inverse[2];
    double rcond[2];
    jf_int line_info[2], info, major, minor, patch;

    jf_version(&major, &minor, &patch);
    jf_set_engine(&engine, &info);
    if (info != JF_INFO_GOOD)
        return 1;
    jf_invert(&n, &n_freq, a, a_inverse, line_info, rcond, &info);
    return !(info == 1 && line_info[0] == JF_LINE_GOOD && line_info[1] == 1 && a_inverse[0] == 0.5);
}
