/* jointfrf: the flat face of the kernel for C and C++. The same symbols serve FORTRAN 77, modern Fortran and Python.
 *
 * Every argument is passed by address, also of what is not read: no NULL. Arrays are as C writes them with trans = "T":
 * h[freq][out][in]. DOFs count from 1.
 * What each argument means, its shape and unit stands in the man page of the routine, and in fortran/api.F90.
 *
 * jf_complex is two doubles, real part first: double complex in C99, std::complex<double> in C++. Define JF_COMPLEX
 * before including this header to use a type of your own of that layout.
 */
#ifndef JOINTFRF_H
#define JOINTFRF_H

#ifdef JF_COMPLEX
typedef JF_COMPLEX jf_complex;
#elif defined(__cplusplus)
#include <complex>
typedef std::complex<double> jf_complex;
#else
#include <complex.h>
typedef double _Complex jf_complex;
#endif

/* info: 0 good; -i argument i is wrong, counted from 1; > 0 number of bad lines */
#define JF_INFO_GOOD 0
#define JF_INFO_NO_MEMORY (-1000)
#define JF_INFO_NO_ENGINE (-1001)
/* line_info: 0 good; > 0 singular */
#define JF_LINE_GOOD 0
#define JF_LINE_NOT_FINITE (-1)
#define JF_LINE_OVERFLOW (-2)
/* engines; JF_ENGINE_AUTOMATIC is the widest there is */
#define JF_ENGINE_AUTOMATIC 0
#define JF_ENGINE_LAPACK 1
#define JF_ENGINE_PLAIN 2
#define JF_ENGINE_X86_64_V2 3
#define JF_ENGINE_X86_64_V3 4
#define JF_ENGINE_X86_64_V4 5

#ifdef __cplusplus
extern "C" {
#endif

void jf_version_(int *major, int *minor, int *patch);
void jf_info_text_(const int *info, const int *n_text, char *text);
void jf_line_text_(const int *line_info, const int *n_text, char *text);
void jf_set_engine_(const int *engine, int *info);
void jf_get_engine_(int *engine, int *info);
void jf_invert_(const int *n, const int *n_freq, const jf_complex *a, jf_complex *a_inverse, int *line_info, double
    *rcond, int *info);
void jf_solve_(const char *trans, const int *n, const int *n_rhs, const int *n_freq, const jf_complex *a, const
    jf_complex *b, jf_complex *x, int *line_info, double *rcond, int *info);
void jf_receptance_(const char *trans, const int *n, const int *n_freq, const int *n_out, const int *n_in, const
    double *omega, const double *stiffness, const double *mass, const int *n_damping, const double *damping, const
    int *n_structural, const double *structural, const double *loss_factor, const int *outputs, const int *inputs,
    jf_complex *h, int *line_info, double *rcond, int *info);
void jf_receptance_banded_(const char *trans, const int *n, const int *kl, const int *ku, const int *n_freq, const
    int *n_out, const int *n_in, const double *omega, const double *stiffness, const double *mass, const int
    *n_damping, const double *damping, const int *n_structural, const double *structural, const double *loss_factor,
    const int *outputs, const int *inputs, jf_complex *h, int *line_info, double *rcond, int *info);
void jf_receptance_modal_(const char *trans, const int *n_modes, const int *n_freq, const int *n_out, const int
    *n_in, const double *omega, const double *stiffness, const double *damping, const double *loss_factor, const
    double *shapes_out, const double *shapes_in, jf_complex *h, int *line_info, double *rcond, int *info);
void jf_couple_(const char *trans, const int *n_a, const int *n_b, const int *n_j, const int *n_freq, const
    jf_complex *h_a, const jf_complex *h_b, const jf_complex *k_joint, const int *dofs_a, const int *dofs_b,
    jf_complex *h_c, int *line_info, double *rcond, int *info);
void jf_modify_(const char *trans, const int *n, const int *n_m, const int *n_freq, const jf_complex *alpha, const
    jf_complex *d, const int *dofs, jf_complex *gamma, int *line_info, double *rcond, int *info);
void jf_find_modification_(const char *trans, const int *n, const int *n_freq, const jf_complex *alpha, const
    jf_complex *gamma, jf_complex *d, int *line_info, double *rcond, int *info);
void jf_ismm_(const char *trans, const int *n, const int *n_freq, const jf_complex *alpha, const jf_complex *gamma,
    const jf_complex *k_initial, jf_complex *k_joint, int *line_info, double *rcond, int *info);
void jf_inverse_substructuring_(const char *trans, const int *n, const int *n_freq, const jf_complex *gamma,
    jf_complex *k_joint, int *line_info, double *rcond, int *info);
void jf_decouple_(const char *equation, const char *trans, const int *n_a, const int *n_b, const int *n, const int
    *n_freq, const jf_complex *h_a, const jf_complex *h_b, const jf_complex *h_c, const int *dofs_j, const int
    *dofs_k, const int *dofs_r, const int *dofs_s, jf_complex *k_joint, int *line_info, double *rcond, int *info);
void jf_joint_compliance_(const char *trans, const int *n, const int *n_freq, const jf_complex *gamma, jf_complex
    *c_joint, int *line_info, double *rcond, int *info);
void jf_compliance_factors_(const char *trans, const int *n, const int *m, const int *n_freq, const jf_complex *gamma,
    const double *transform, jf_complex *factors, int *line_info, double *rcond, int *info);
void jf_compliance_covariance_(const char *trans, const int *reciprocal, const int *n, const int *m, const int
    *n_freq, const jf_complex *gamma, const double *transform, const double *variance, jf_complex *covariance, int
    *line_info, double *rcond, int *info);
void jf_difference_weights_(const int *m, const double *offset, double *weights, int *info);
void jf_central_difference_(const char *trans, const int *m, const int *n_freq, const double *offset, const
    jf_complex *h, jf_complex *h_new, int *line_info, double *rcond, int *info);
void jf_transform_(const char *trans, const int *n_out, const int *n_in, const int *m_out, const int *m_in, const
    int *n_freq, const jf_complex *h, const double *t_out, const double *t_in, jf_complex *h_new, int *line_info,
    double *rcond, int *info);
void jf_pollute_(const char *trans, const char *kind, const char *reference, const int *reciprocal, const int *block,
    const double *level, const int *seed, const int *n_out, const int *n_in, const int *n_freq, const int *first, const
    int *count, const jf_complex *h, jf_complex *polluted, int *info);
void jf_monte_carlo_(const char *trans, const char *method, const char *kind, const char *reference, const int
    *reciprocal, const int *block, const double *level, const int *seed, const int *n, const int *n_freq, const int
    *first, const int *count, const jf_complex *alpha, const jf_complex *gamma, const jf_complex *k_initial, int *good,
    jf_complex *mean, double *covariance, int *line_info, double *rcond, int *info);
void jf_brick_matrices_(const char *formulation, const int *n_elements, const double *coordinates, const double
    *youngs_modulus, const double *poisson, const double *density, const double *hourglass, const int *lumped, double
    *stiffness, double *mass, int *element_info, int *info);
void jf_brick_quality_(const int *n_elements, const double *coordinates, double *scaled_jacobian, double
    *aspect_ratio, int *info);

/* the names without the trailing underscore */
#define jf_version jf_version_
#define jf_info_text jf_info_text_
#define jf_line_text jf_line_text_
#define jf_set_engine jf_set_engine_
#define jf_get_engine jf_get_engine_
#define jf_invert jf_invert_
#define jf_solve jf_solve_
#define jf_receptance jf_receptance_
#define jf_receptance_banded jf_receptance_banded_
#define jf_receptance_modal jf_receptance_modal_
#define jf_couple jf_couple_
#define jf_modify jf_modify_
#define jf_find_modification jf_find_modification_
#define jf_ismm jf_ismm_
#define jf_inverse_substructuring jf_inverse_substructuring_
#define jf_decouple jf_decouple_
#define jf_joint_compliance jf_joint_compliance_
#define jf_compliance_factors jf_compliance_factors_
#define jf_compliance_covariance jf_compliance_covariance_
#define jf_difference_weights jf_difference_weights_
#define jf_central_difference jf_central_difference_
#define jf_transform jf_transform_
#define jf_pollute jf_pollute_
#define jf_monte_carlo jf_monte_carlo_
#define jf_brick_matrices jf_brick_matrices_
#define jf_brick_quality jf_brick_quality_

#ifdef __cplusplus
}
#endif
#endif
