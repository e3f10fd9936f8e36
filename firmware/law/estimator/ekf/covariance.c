#include "covariance.h"

/* A row of F: of the current (a, C, g) or of the flux (m, E, h). */
typedef struct {
    float of_current;
    ab_t of_flux;
    ab_t of_speed;
} row_t;

/* A column of P, or of (F P)': its current, flux and speed. */
static inline ab_t row_times(const row_t *row, ab_t current, ab_t flux, float speed)
{
    return ab_add(ab_add(ab_scale(current, row->of_current), ab_mul(row->of_flux, flux)),
                  ab_scale(row->of_speed, speed));
}

/* The same for both columns of a block. */
static inline block_t row_block(const row_t *row, const block_t *current, const block_t *flux,
                                ab_t speed)
{
    return (block_t){row_times(row, current->alpha, flux->alpha, speed.alpha),
                     row_times(row, current->beta, flux->beta, speed.beta)};
}

static inline block_t transposed(const block_t *a)
{
    return (block_t){{a->alpha.alpha, a->beta.alpha}, {a->alpha.beta, a->beta.beta}};
}

/* A symmetric block stays one in spite of rounding; Q on its diagonal. */
static inline block_t symmetric(const block_t *a, float noise)
{
    const float across = 0.5f * (a->alpha.beta + a->beta.alpha);
    return (block_t){{a->alpha.alpha + noise, across}, {across, a->beta.beta + noise}};
}

/* A row of F P with respect to i and l, as its transpose: what F' is applied to. */
typedef struct {
    block_t of_current;
    block_t of_flux;
    ab_t of_speed;
} product_t;

static inline product_t row_product(const row_t *row, const covariance_t *P)
{
    const block_t il = transposed(&P->li);
    const block_t current = row_block(row, &P->ii, &P->li, P->iw);
    const block_t flux = row_block(row, &il, &P->ll, P->lw);
    return (product_t){.of_current = transposed(&current),
                       .of_flux = transposed(&flux),
                       .of_speed = row_times(row, P->iw, P->lw, P->ww)};
}

static inline block_t times_row(const row_t *row, const product_t *FP)
{
    return row_block(row, &FP->of_current, &FP->of_flux, FP->of_speed);
}

void covariance_predict(covariance_t *P, const transition_t *F, const covariance_noise_t *Q)
{
    const row_t current = {F->current_own, F->current_flux, F->current_speed};
    const row_t flux = {F->flux_current, F->flux_own, F->flux_speed};
    const product_t current_P = row_product(&current, P);
    const product_t flux_P = row_product(&flux, P);
    const block_t ii = times_row(&current, &current_P);
    const block_t ll = times_row(&flux, &flux_P);
    P->ii = symmetric(&ii, Q->current);
    P->li = times_row(&flux, &current_P);
    P->ll = symmetric(&ll, Q->flux);
    P->iw = current_P.of_speed;
    P->lw = flux_P.of_speed;
    P->ww += Q->speed;
}

/* Two blocks, and their difference. */
static inline block_t product(const block_t *a, const block_t *b)
{
    return (block_t){block_times(a, b->alpha), block_times(a, b->beta)};
}

static inline block_t less(const block_t *a, const block_t *b)
{
    return (block_t){ab_sub(a->alpha, b->alpha), ab_sub(a->beta, b->beta)};
}

/* (H P H' + R)^-1 */
static inline block_t inverse(const block_t *ii, float R)
{
    const float a = ii->alpha.alpha + R;
    const float b = ii->alpha.beta;
    const float d = ii->beta.beta + R;
    const float scale = 1.0f / (a * d - b * b);
    const ab_t alpha = {scale * d, -scale * b};
    const ab_t beta = {alpha.beta, scale * a};
    return (block_t){alpha, beta};
}

void covariance_update(covariance_t *P, float R, covariance_gain_t *K)
{
    const block_t inv = inverse(&P->ii, R);
    *K = (covariance_gain_t){.current = product(&P->ii, &inv),
                             .flux = product(&P->li, &inv),
                             .speed = block_times(&inv, P->iw)};
    const block_t il = transposed(&P->li);
    const block_t of_ii = product(&K->current, &P->ii);
    const block_t of_li = product(&K->flux, &P->ii);
    const block_t of_ll = product(&K->flux, &il);
    const block_t ii = less(&P->ii, &of_ii);
    const block_t ll = less(&P->ll, &of_ll);
    P->ii = symmetric(&ii, 0.0f);
    P->li = less(&P->li, &of_li);
    P->ll = symmetric(&ll, 0.0f);
    P->lw = ab_sub(P->lw, block_times(&K->flux, P->iw));
    P->ww -= ab_dot(K->speed, P->iw);
    P->iw = ab_sub(P->iw, block_times(&K->current, P->iw));
}

void covariance_know_speed(covariance_t *P)
{
    P->iw = (ab_t){0.0f, 0.0f};
    P->lw = (ab_t){0.0f, 0.0f};
    P->ww = 0.0f;
}
