/* SPDX-License-Identifier: MIT */
#include "hal/linux/files/histogram.h"

enum { SHARES = 1 << CB_HISTOGRAM_SHARE_BITS };

/* Position of the highest set bit; ns > 0. */
static unsigned highest_bit(uint64_t ns) {
    return 63u - (unsigned)__builtin_clzll(ns);
}

/* Below 2 * SHARES a bucket is one ns wide; each further power of two has SHARES buckets. */
static unsigned bucket_of(uint64_t ns) {
    if (ns < SHARES) return (unsigned)ns;
    unsigned shift = highest_bit(ns) - CB_HISTOGRAM_SHARE_BITS;
    unsigned bucket = (shift + 1) * SHARES + (unsigned)((ns >> shift) - SHARES);
    return bucket < CB_HISTOGRAM_BUCKETS ? bucket : CB_HISTOGRAM_BUCKETS - 1;
}

static int64_t middle_of(unsigned bucket) {
    if (bucket < SHARES) return bucket;
    unsigned shift = bucket / SHARES - 1;
    uint64_t low = (uint64_t)(bucket % SHARES + SHARES) << shift;
    return (int64_t)(low + ((1ull << shift) - 1) / 2);
}

void cb_histogram_add(struct cb_histogram *histogram, int64_t ns) {
    if (ns < 0) ns = 0;
    if (histogram->count == 0 || ns < histogram->min_ns) histogram->min_ns = ns;
    if (ns > histogram->max_ns) histogram->max_ns = ns;
    histogram->count++;
    histogram->sum_ns += (double)ns;
    histogram->buckets[bucket_of((uint64_t)ns)]++;
}

int64_t cb_histogram_percentile(const struct cb_histogram *histogram, double share) {
    double wanted = share * (double)histogram->count;
    uint64_t seen = 0;
    for (unsigned i = 0; i < CB_HISTOGRAM_BUCKETS; i++) {
        seen += histogram->buckets[i];
        if (seen == 0 || (double)seen < wanted) continue;
        int64_t middle = middle_of(i);
        if (middle < histogram->min_ns) return histogram->min_ns;
        return middle > histogram->max_ns ? histogram->max_ns : middle;
    }
    return histogram->max_ns;
}

uint64_t cb_histogram_up_to(const struct cb_histogram *histogram, int64_t ns) {
    const unsigned last = bucket_of((uint64_t)ns);
    uint64_t seen = 0;
    for (unsigned i = 0; i <= last; i++) seen += histogram->buckets[i];
    return seen;
}

double cb_histogram_mean(const struct cb_histogram *histogram) {
    return histogram->count == 0 ? 0.0 : histogram->sum_ns / (double)histogram->count;
}
