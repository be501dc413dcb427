/* The symbol to which jointfrf.h refers, so that a C program meant for integers of the other length does not link. */
#ifdef JF_ILP64
const char jf_integers_have_8_bytes_ = 8;
#else
const char jf_integers_have_4_bytes_ = 4;
#endif
