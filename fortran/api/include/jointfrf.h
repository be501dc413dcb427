/* jointfrf: the flat API of the kernel for C and C++. The same symbols serve FORTRAN 77, modern Fortran and Python.
 *
 * Every argument is passed by address, also of what is not read: no NULL. Arrays are as C writes them with trans = "T":
 * h[freq][out][in]. DOFs count from 1.
 * What each argument means, its shape and unit stands in the man page of the routine, and in fortran/api/api.F90.
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

/* Integers are int. In the library jointfrf64, for programs whose default INTEGER has eight bytes, they have eight; its
   pkg-config file and its CMake package define JF_ILP64. */
#ifdef JF_ILP64
#include <stdint.h>
typedef int64_t jf_int;
#else
typedef int jf_int;
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

/* Each library has one of these two symbols. A program that refers to the other's does not link. Programs that open the
   library at run time define JF_NO_LINK_CHECK, and look for the symbol themselves. */
#if defined(__GNUC__) && !defined(JF_NO_LINK_CHECK)
#ifdef JF_ILP64
extern const char jf_integers_have_8_bytes_;
__attribute__((used)) static const char *const jf_link_check = &jf_integers_have_8_bytes_;
#else
extern const char jf_integers_have_4_bytes_;
__attribute__((used)) static const char *const jf_link_check = &jf_integers_have_4_bytes_;
#endif
#endif

void jf_version_(jf_int *major, jf_int *minor, jf_int *patch);
void jf_info_text_(const jf_int *info, const jf_int *n_text, char *text);
void jf_line_text_(const jf_int *line_info, const jf_int *n_text, char *text);
void jf_set_engine_(const jf_int *engine, jf_int *info);
void jf_get_engine_(jf_int *engine, jf_int *info);
void jf_invert_(const jf_int *n, const jf_int *n_freq, const jf_complex *a, jf_complex *a_inverse, jf_int
    *line_info, double *rcond, jf_int *info);
void jf_solve_(const char *trans, const jf_int *n, const jf_int *n_rhs, const jf_int *n_freq, const jf_complex *a,
    const jf_complex *b, jf_complex *x, jf_int *line_info, double *rcond, jf_int *info);
void jf_receptance_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_int *n_out, const jf_int
    *n_in, const double *omega, const double *stiffness, const double *mass, const jf_int *n_damping, const double
    *damping, const jf_int *n_structural, const double *structural, const double *loss_factor, const jf_int
    *outputs, const jf_int *inputs, jf_complex *h, jf_int *line_info, double *rcond, jf_int *info);
void jf_receptance_banded_(const char *trans, const jf_int *n, const jf_int *kl, const jf_int *ku, const jf_int
    *n_freq, const jf_int *n_out, const jf_int *n_in, const double *omega, const double *stiffness, const double
    *mass, const jf_int *n_damping, const double *damping, const jf_int *n_structural, const double *structural,
    const double *loss_factor, const jf_int *outputs, const jf_int *inputs, jf_complex *h, jf_int *line_info, double
    *rcond, jf_int *info);
void jf_receptance_modal_(const char *trans, const jf_int *n_modes, const jf_int *n_freq, const jf_int *n_out, const
    jf_int *n_in, const double *omega, const double *stiffness, const double *damping, const double *loss_factor,
    const double *shapes_out, const double *shapes_in, jf_complex *h, jf_int *line_info, double *rcond, jf_int
    *info);
void jf_couple_(const char *trans, const jf_int *n_a, const jf_int *n_b, const jf_int *n_j, const jf_int *n_freq,
    const jf_complex *h_a, const jf_complex *h_b, const jf_complex *k_joint, const jf_int *dofs_a, const jf_int
    *dofs_b, jf_complex *h_c, jf_int *line_info, double *rcond, jf_int *info);
void jf_modify_(const char *trans, const jf_int *n, const jf_int *n_m, const jf_int *n_freq, const jf_complex
    *alpha, const jf_complex *d, const jf_int *dofs, jf_complex *gamma, jf_int *line_info, double *rcond, jf_int
    *info);
void jf_find_modification_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *alpha, const
    jf_complex *gamma, jf_complex *d, jf_int *line_info, double *rcond, jf_int *info);
void jf_ismm_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *alpha, const jf_complex
    *gamma, const jf_complex *k_initial, jf_complex *k_joint, jf_int *line_info, double *rcond, jf_int *info);
void jf_inverse_substructuring_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *gamma,
    jf_complex *k_joint, jf_int *line_info, double *rcond, jf_int *info);
void jf_decouple_(const char *equation, const char *trans, const jf_int *n_a, const jf_int *n_b, const jf_int *n,
    const jf_int *n_freq, const jf_complex *h_a, const jf_complex *h_b, const jf_complex *h_c, const jf_int *dofs_j,
    const jf_int *dofs_k, const jf_int *dofs_r, const jf_int *dofs_s, jf_complex *k_joint, jf_int *line_info, double
    *rcond, jf_int *info);
void jf_joint_compliance_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *gamma,
    jf_complex *c_joint, jf_int *line_info, double *rcond, jf_int *info);
void jf_compliance_factors_(const char *trans, const jf_int *n, const jf_int *m, const jf_int *n_freq, const
    jf_complex *gamma, const double *transform, jf_complex *factors, jf_int *line_info, double *rcond, jf_int
    *info);
void jf_compliance_covariance_(const char *trans, const jf_int *reciprocal, const jf_int *n, const jf_int *m, const
    jf_int *n_freq, const jf_complex *gamma, const double *transform, const double *variance, jf_complex
    *covariance, jf_int *line_info, double *rcond, jf_int *info);
void jf_difference_weights_(const jf_int *m, const double *offset, double *weights, jf_int *info);
void jf_central_difference_(const char *trans, const jf_int *m, const jf_int *n_freq, const double *offset, const
    jf_complex *h, jf_complex *h_new, jf_int *line_info, double *rcond, jf_int *info);
void jf_transform_(const char *trans, const jf_int *n_out, const jf_int *n_in, const jf_int *m_out, const jf_int
    *m_in, const jf_int *n_freq, const jf_complex *h, const double *t_out, const double *t_in, jf_complex *h_new,
    jf_int *line_info, double *rcond, jf_int *info);
void jf_pollute_(const char *trans, const char *kind, const char *reference, const jf_int *reciprocal, const jf_int
    *block, const double *level, const jf_int *seed, const jf_int *n_out, const jf_int *n_in, const jf_int *n_freq,
    const jf_int *first, const jf_int *count, const jf_complex *h, jf_complex *polluted, jf_int *info);
void jf_monte_carlo_(const char *trans, const char *method, const char *kind, const char *reference, const jf_int
    *reciprocal, const jf_int *block, const double *level, const jf_int *seed, const jf_int *n, const jf_int
    *n_freq, const jf_int *first, const jf_int *count, const jf_complex *alpha, const jf_complex *gamma, const
    jf_complex *k_initial, jf_int *good, jf_complex *mean, double *covariance, jf_int *line_info, double *rcond,
    jf_int *info);
void jf_brick_matrices_(const char *formulation, const jf_int *n_elements, const double *coordinates, const double
    *youngs_modulus, const double *poisson, const double *density, const double *hourglass, const jf_int *lumped,
    double *stiffness, double *mass, jf_int *element_info, jf_int *info);
void jf_brick_quality_(const jf_int *n_elements, const double *coordinates, double *scaled_jacobian, double
    *aspect_ratio, jf_int *info);
void jf_invert_work_(const jf_int *n, const jf_int *n_freq, const jf_complex *a, jf_complex *a_inverse, jf_int
    *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int
    *info);
void jf_solve_work_(const char *trans, const jf_int *n, const jf_int *n_rhs, const jf_int *n_freq, const jf_complex
    *a, const jf_complex *b, jf_complex *x, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork,
    jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_receptance_work_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_int *n_out, const jf_int
    *n_in, const double *omega, const double *stiffness, const double *mass, const jf_int *n_damping, const double
    *damping, const jf_int *n_structural, const double *structural, const double *loss_factor, const jf_int
    *outputs, const jf_int *inputs, jf_complex *h, jf_int *line_info, double *rcond, jf_complex *work, const jf_int
    *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_receptance_banded_work_(const char *trans, const jf_int *n, const jf_int *kl, const jf_int *ku, const jf_int
    *n_freq, const jf_int *n_out, const jf_int *n_in, const double *omega, const double *stiffness, const double
    *mass, const jf_int *n_damping, const double *damping, const jf_int *n_structural, const double *structural,
    const double *loss_factor, const jf_int *outputs, const jf_int *inputs, jf_complex *h, jf_int *line_info, double
    *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_receptance_modal_work_(const char *trans, const jf_int *n_modes, const jf_int *n_freq, const jf_int *n_out,
    const jf_int *n_in, const double *omega, const double *stiffness, const double *damping, const double
    *loss_factor, const double *shapes_out, const double *shapes_in, jf_complex *h, jf_int *line_info, double
    *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_couple_work_(const char *trans, const jf_int *n_a, const jf_int *n_b, const jf_int *n_j, const jf_int
    *n_freq, const jf_complex *h_a, const jf_complex *h_b, const jf_complex *k_joint, const jf_int *dofs_a, const
    jf_int *dofs_b, jf_complex *h_c, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int
    *iwork, const jf_int *liwork, jf_int *info);
void jf_modify_work_(const char *trans, const jf_int *n, const jf_int *n_m, const jf_int *n_freq, const jf_complex
    *alpha, const jf_complex *d, const jf_int *dofs, jf_complex *gamma, jf_int *line_info, double *rcond, jf_complex
    *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_find_modification_work_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *alpha,
    const jf_complex *gamma, jf_complex *d, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork,
    jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_ismm_work_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *alpha, const
    jf_complex *gamma, const jf_complex *k_initial, jf_complex *k_joint, jf_int *line_info, double *rcond,
    jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_inverse_substructuring_work_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex
    *gamma, jf_complex *k_joint, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int
    *iwork, const jf_int *liwork, jf_int *info);
void jf_decouple_work_(const char *equation, const char *trans, const jf_int *n_a, const jf_int *n_b, const jf_int
    *n, const jf_int *n_freq, const jf_complex *h_a, const jf_complex *h_b, const jf_complex *h_c, const jf_int
    *dofs_j, const jf_int *dofs_k, const jf_int *dofs_r, const jf_int *dofs_s, jf_complex *k_joint, jf_int
    *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int
    *info);
void jf_joint_compliance_work_(const char *trans, const jf_int *n, const jf_int *n_freq, const jf_complex *gamma,
    jf_complex *c_joint, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork,
    const jf_int *liwork, jf_int *info);
void jf_compliance_factors_work_(const char *trans, const jf_int *n, const jf_int *m, const jf_int *n_freq, const
    jf_complex *gamma, const double *transform, jf_complex *factors, jf_int *line_info, double *rcond, jf_complex
    *work, const jf_int *lwork, jf_int *iwork, const jf_int *liwork, jf_int *info);
void jf_compliance_covariance_work_(const char *trans, const jf_int *reciprocal, const jf_int *n, const jf_int *m,
    const jf_int *n_freq, const jf_complex *gamma, const double *transform, const double *variance, jf_complex
    *covariance, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const
    jf_int *liwork, jf_int *info);
void jf_transform_work_(const char *trans, const jf_int *n_out, const jf_int *n_in, const jf_int *m_out, const
    jf_int *m_in, const jf_int *n_freq, const jf_complex *h, const double *t_out, const double *t_in, jf_complex
    *h_new, jf_int *line_info, double *rcond, jf_complex *work, const jf_int *lwork, jf_int *iwork, const jf_int
    *liwork, jf_int *info);

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
#define jf_invert_work jf_invert_work_
#define jf_solve_work jf_solve_work_
#define jf_receptance_work jf_receptance_work_
#define jf_receptance_banded_work jf_receptance_banded_work_
#define jf_receptance_modal_work jf_receptance_modal_work_
#define jf_couple_work jf_couple_work_
#define jf_modify_work jf_modify_work_
#define jf_find_modification_work jf_find_modification_work_
#define jf_ismm_work jf_ismm_work_
#define jf_inverse_substructuring_work jf_inverse_substructuring_work_
#define jf_decouple_work jf_decouple_work_
#define jf_joint_compliance_work jf_joint_compliance_work_
#define jf_compliance_factors_work jf_compliance_factors_work_
#define jf_compliance_covariance_work jf_compliance_covariance_work_
#define jf_transform_work jf_transform_work_

#ifdef __cplusplus
}
#endif
#endif
