/* Covariance of the extended Kalman filter: symmetric 5 x 5, in blocks of the axes alpha and beta.
 *
 * States: current i, flux l, speed w. F of one period is [a C g; m E h; 0 0 1] with numbers a and
 * m, complex factors C and E and vectors g and h: a column of a block costs eight multiplications,
 * and a period about 200 where full matrices take 500.
 */
#ifndef COVARIANCE_H
#define COVARIANCE_H

#include "frames.h"

/* 2 x 2, its columns. */
typedef struct {
    ab_t alpha;
    ab_t beta;
} block_t;

typedef struct {
    block_t ii; /* symmetric */
    block_t li; /* row l, column i */
    block_t ll; /* symmetric */
    ab_t iw;
    ab_t lw;
    float ww;
} covariance_t;

/* F = I + T df/dx, its rows. */
typedef struct {
    float current_own;  /* a */
    ab_t current_flux;  /* C */
    ab_t current_speed; /* g */
    float flux_current; /* m */
    ab_t flux_own;      /* E */
    ab_t flux_speed;    /* h */
} transition_t;

/* Variances that a period adds, per axis. */
typedef struct {
    float current;
    float flux;
    float speed;
} covariance_noise_t;

/* Gain of the innovation: x += gain (i - i_hat). */
typedef struct {
    block_t current;
    block_t flux;
    ab_t speed; /* scalar product */
} covariance_gain_t;

static inline ab_t block_times(const block_t *a, ab_t x)
{
    return ab_add(ab_scale(a->alpha, x.alpha), ab_scale(a->beta, x.beta));
}

/* P := F P F' + Q. */
void covariance_predict(covariance_t *P, const transition_t *F, const covariance_noise_t *Q);

/* K = P H' (H P H' + R)^-1 with H = the current; P := P - K H P. */
void covariance_update(covariance_t *P, float R, covariance_gain_t *K);

/* The speed is known from outside: no uncertainty of its own, none shared. */
void covariance_know_speed(covariance_t *P);

static inline float block_sum(const block_t *a)
{
    return ab_sum(a->alpha) + ab_sum(a->beta);
}

static inline float covariance_sum(const covariance_t *P)
{
    return block_sum(&P->ii) + block_sum(&P->li) + block_sum(&P->ll) + ab_sum(P->iw) +
           ab_sum(P->lw) + P->ww;
}

#endif
