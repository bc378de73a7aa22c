/* The functions of lathesim/elementary.py in C, operation by operation, for the same bits. */

#include <math.h>

static double raised(double r, double whole)
{
    double r2 = r * r, r4 = r2 * r2;
    double low = (0.5000000000000001 + 0.16666666666666669 * r) + r2 * (0.04166666666662348 + 0.008333333333330011 * r);
    double middle = (0.0013888888917538296 + 0.00019841269863303223 * r) + r2 * (2.4801520792572694e-05 + 2.75572680728901e-06 * r);
    double high = 2.762032742826824e-07 + 2.5100569275813683e-08 * r;
    return ldexp(1.0, (int)whole - 1) * (2.0 * (1.0 + (r + r2 * (low + r4 * (middle + r4 * high)))));
}

static double own_exp2(double x)
{
    if (x >= 1024.0) return INFINITY;
    if (x < -1021.0) return 0.0;
    double whole = (x + 6755399441055744.0) - 6755399441055744.0;
    return raised((x - whole) * 0.6931471805599453, whole);
}

static double own_exp(double x)
{
    if (x > 709.782712893384) return INFINITY;
    if (x < -708.0) return 0.0;
    double whole = (x * 1.4426950408889634 + 6755399441055744.0) - 6755399441055744.0;
    return raised((x - whole * 0.6931471806019545) - whole * -4.2009150726810846e-11, whole);
}

static double split(double x, double *f, double *half, double *bent)
{
    int e;
    double m = frexp(x, &e);
    if (m < 0.7071067811865476) m = m + m, e = e - 1;
    *f = m - 1.0;
    *half = 0.5 * *f * *f;
    double s = *f / (2.0 + *f), z = s * s, z2 = z * z;
    double low = (0.6666666666666666 + 0.4000000000000089 * z) + z2 * (0.28571428570795937 + 0.22222222393451754 * z);
    double high = (0.18181795454619543 + 0.15386249783145445 * z) + z2 * (0.13268503447787144 + 0.1308944373631696 * z);
    *bent = s * (*half + z * (low + z2 * z2 * high));
    return e;
}

static double own_log2(double x)
{
    double f, half, bent, e;
    if (!(x >= 2.2250738585072014e-308)) return x >= 0.0 ? -INFINITY : NAN;
    if (x == INFINITY) return x;
    e = split(x, &f, &half, &bent);
    return e + (f - (half - bent)) * 1.4426950408889634;
}

static double own_log(double x)
{
    double f, half, bent, e;
    if (!(x >= 2.2250738585072014e-308)) return x >= 0.0 ? -INFINITY : NAN;
    if (x == INFINITY) return x;
    e = split(x, &f, &half, &bent);
    return e * 0.6931471806019545 + (f - (half - (bent + e * -4.2009150726810846e-11)));
}
