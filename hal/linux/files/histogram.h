/* SPDX-License-Identifier: MIT
 * Distribution of times in fixed memory: 32 buckets for each power of two, from 0 to over an hour.
 * A percentile is accurate within 1/64 of its value (and exact below 32 ns). */
#ifndef COMPBOX_HAL_LINUX_FILES_HISTOGRAM_H
#define COMPBOX_HAL_LINUX_FILES_HISTOGRAM_H

#include <stdint.h>

enum {
    CB_HISTOGRAM_SHARE_BITS = 5, /* 2^5 buckets for each power of two */
    CB_HISTOGRAM_MAX_BITS = 42,  /* 2^42 ns = 73 minutes; the maximum of longer times */
    CB_HISTOGRAM_BUCKETS = (CB_HISTOGRAM_MAX_BITS - CB_HISTOGRAM_SHARE_BITS + 1)
                           << CB_HISTOGRAM_SHARE_BITS,
};

struct cb_histogram {
    uint64_t count;
    int64_t min_ns, max_ns; /* 0 while count is 0 */
    double sum_ns;
    uint32_t buckets[CB_HISTOGRAM_BUCKETS];
};

/* Adds a time; negative times count as 0. */
void cb_histogram_add(struct cb_histogram *histogram, int64_t ns);

/* in : share 0 … 1
 * out: the time that this share of all does not exceed (bucket middle, never beyond the maximum); 0
 *      without times */
int64_t cb_histogram_percentile(const struct cb_histogram *histogram, double share);

/* out: number of times up to ns, exact to the width of a bucket */
uint64_t cb_histogram_up_to(const struct cb_histogram *histogram, int64_t ns);

/* out: the mean; 0 without times */
double cb_histogram_mean(const struct cb_histogram *histogram);

#endif
