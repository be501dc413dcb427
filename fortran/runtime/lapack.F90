!> Explicit interfaces to the LAPACK and BLAS routines the kernel uses, and the only place that knows how their symbols
!> are spelt: JF_BLAS_PREFIX is empty for a system library and `scipy_` for the one that the Python package brings.
!>
!> The hidden lengths of CHARACTER arguments are passed by value at the end, as the compiled libraries expect them.
#ifndef JF_BLAS_PREFIX
#define JF_BLAS_PREFIX ""
#endif
module jointfrf_lapack
  use, intrinsic :: iso_c_binding, only: c_char, c_size_t
  use jointfrf_kinds, only: blas_ip, dp
  implicit none
  private
  public :: dgemm, dposv, dsyev, zgeev, zgesv, zgetrf, zgetri, zgetrs, zgecon, zgbtrf, zgbtrs, zgbcon, zgemm, &
    zgemv

  interface
    !> Solve A X = B of a positive definite A by Cholesky's factors.
    subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info, uplo_len) bind(C, name=JF_BLAS_PREFIX//"dposv_")
      import :: blas_ip, c_char, c_size_t, dp
      implicit none
      character(kind=c_char), intent(in) :: uplo
      integer(blas_ip), intent(in) :: n, nrhs, lda, ldb
      real(dp), intent(inout) :: a(lda, *), b(ldb, *)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: uplo_len
    end subroutine dposv

    !> Eigenvalues, ascending, and eigenvectors of a symmetric matrix, which leaves as the vectors.
    subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info, jobz_len, uplo_len) &
      bind(C, name=JF_BLAS_PREFIX//"dsyev_")
      import :: blas_ip, c_char, c_size_t, dp
      implicit none
      character(kind=c_char), intent(in) :: jobz, uplo
      integer(blas_ip), intent(in) :: n, lda, lwork
      real(dp), intent(inout) :: a(lda, *)
      real(dp), intent(out) :: w(*), work(*)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: jobz_len, uplo_len
    end subroutine dsyev

    !> Solve A X = B by LU with partial pivoting; A leaves as its factors.
    subroutine zgesv(n, nrhs, a, lda, ipiv, b, ldb, info) bind(C, name=JF_BLAS_PREFIX//"zgesv_")
      import :: dp, blas_ip
      implicit none
      integer(blas_ip), intent(in) :: n, nrhs, lda, ldb
      complex(dp), intent(inout) :: a(lda, *), b(ldb, *)
      integer(blas_ip), intent(out) :: ipiv(*), info
    end subroutine zgesv

    !> LU factors of a general matrix.
    subroutine zgetrf(m, n, a, lda, ipiv, info) bind(C, name=JF_BLAS_PREFIX//"zgetrf_")
      import :: dp, blas_ip
      implicit none
      integer(blas_ip), intent(in) :: m, n, lda
      complex(dp), intent(inout) :: a(lda, *)
      integer(blas_ip), intent(out) :: ipiv(*), info
    end subroutine zgetrf

    !> Solve op(A) X = B with LU factors.
    subroutine zgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info, trans_len) bind(C, name=JF_BLAS_PREFIX//"zgetrs_")
      import :: blas_ip, c_char, c_size_t, dp
      implicit none
      character(kind=c_char), intent(in) :: trans
      integer(blas_ip), intent(in) :: n, nrhs, lda, ldb, ipiv(*)
      complex(dp), intent(in) :: a(lda, *)
      complex(dp), intent(inout) :: b(ldb, *)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: trans_len
    end subroutine zgetrs

    !> Inverse from LU factors.
    subroutine zgetri(n, a, lda, ipiv, work, lwork, info) bind(C, name=JF_BLAS_PREFIX//"zgetri_")
      import :: dp, blas_ip
      implicit none
      integer(blas_ip), intent(in) :: n, lda, ipiv(*), lwork
      complex(dp), intent(inout) :: a(lda, *)
      complex(dp), intent(out) :: work(*)
      integer(blas_ip), intent(out) :: info
    end subroutine zgetri

    !> Reciprocal condition number from LU factors.
    subroutine zgecon(norm, n, a, lda, anorm, rcond, work, rwork, info, norm_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgecon_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: norm
      integer(blas_ip), intent(in) :: n, lda
      complex(dp), intent(in) :: a(lda, *)
      real(dp), intent(in) :: anorm
      real(dp), intent(out) :: rcond, rwork(*)
      complex(dp), intent(out) :: work(*)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: norm_len
    end subroutine zgecon

    !> LU factors of a band matrix.
    subroutine zgbtrf(m, n, kl, ku, ab, ldab, ipiv, info) bind(C, name=JF_BLAS_PREFIX//"zgbtrf_")
      import :: dp, blas_ip
      implicit none
      integer(blas_ip), intent(in) :: m, n, kl, ku, ldab
      complex(dp), intent(inout) :: ab(ldab, *)
      integer(blas_ip), intent(out) :: ipiv(*), info
    end subroutine zgbtrf

    !> Solve with the LU factors of a band matrix.
    subroutine zgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info, trans_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgbtrs_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: trans
      integer(blas_ip), intent(in) :: n, kl, ku, nrhs, ldab, ipiv(*), ldb
      complex(dp), intent(in) :: ab(ldab, *)
      complex(dp), intent(inout) :: b(ldb, *)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: trans_len
    end subroutine zgbtrs

    !> Reciprocal condition number from the LU factors of a band matrix.
    subroutine zgbcon(norm, n, kl, ku, ab, ldab, ipiv, anorm, rcond, work, rwork, info, norm_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgbcon_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: norm
      integer(blas_ip), intent(in) :: n, kl, ku, ldab, ipiv(*)
      complex(dp), intent(in) :: ab(ldab, *)
      real(dp), intent(in) :: anorm
      real(dp), intent(out) :: rcond, rwork(*)
      complex(dp), intent(out) :: work(*)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: norm_len
    end subroutine zgbcon

    !> C = alpha op(A) op(B) + beta C, real.
    subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc, transa_len, transb_len) &
      bind(C, name=JF_BLAS_PREFIX//"dgemm_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: transa, transb
      integer(blas_ip), intent(in) :: m, n, k, lda, ldb, ldc
      real(dp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
      real(dp), intent(inout) :: c(ldc, *)
      integer(c_size_t), value :: transa_len, transb_len
    end subroutine dgemm

    !> Eigenvalues w of a general matrix, and eigenvectors where asked for.
    subroutine zgeev(jobvl, jobvr, n, a, lda, w, vl, ldvl, vr, ldvr, work, lwork, rwork, info, jobvl_len, jobvr_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgeev_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: jobvl, jobvr
      integer(blas_ip), intent(in) :: n, lda, ldvl, ldvr, lwork
      complex(dp), intent(inout) :: a(lda, *)
      complex(dp), intent(out) :: w(*), vl(ldvl, *), vr(ldvr, *), work(*)
      real(dp), intent(out) :: rwork(*)
      integer(blas_ip), intent(out) :: info
      integer(c_size_t), value :: jobvl_len, jobvr_len
    end subroutine zgeev

    !> C = alpha op(A) op(B) + beta C.
    subroutine zgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc, transa_len, transb_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgemm_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: transa, transb
      integer(blas_ip), intent(in) :: m, n, k, lda, ldb, ldc
      complex(dp), intent(in) :: alpha, beta, a(lda, *), b(ldb, *)
      complex(dp), intent(inout) :: c(ldc, *)
      integer(c_size_t), value :: transa_len, transb_len
    end subroutine zgemm

    !> y = alpha op(A) x + beta y.
    subroutine zgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy, trans_len) &
      bind(C, name=JF_BLAS_PREFIX//"zgemv_")
      import :: dp, blas_ip, c_char, c_size_t
      implicit none
      character(kind=c_char), intent(in) :: trans
      integer(blas_ip), intent(in) :: m, n, lda, incx, incy
      complex(dp), intent(in) :: alpha, beta, a(lda, *), x(*)
      complex(dp), intent(inout) :: y(*)
      integer(c_size_t), value :: trans_len
    end subroutine zgemv
  end interface
end module jointfrf_lapack
