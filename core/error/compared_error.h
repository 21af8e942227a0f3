/// Error of a biased image F by comparison with two independent unbiased images U and V of the same
/// view, which share no samples with F:
///   m = (F - U)(F - V)
/// has the expected value of (F - mu)^2, bias and noise together, whatever F is. m is relative to
/// the light of F, bounded and pooled (core/error/squared_error.h). U and V are the halves of one
/// film, whose doubt widens the interval: light that F lacks and that only one of U and V has found
/// is not in m.
#pragma once

#include "core/error/error_estimate.h"

namespace core {

/// references: U and V as halves, of the same rectangle as `image`. The error is unknown if any
/// pixel of a half has no sample.
ErrorEstimate compared_error(const FilmSnapshot& image, const FilmSnapshot& references);

/// Returns the part of the error that more samples do not remove: 0.8 times the mean root of
///   (FA - U)(FB - V),
/// whose expected value is the squared bias, because FA and FB are independent too. NaN if a half
/// is missing.
double compared_bias(const FilmSnapshot& image, const FilmSnapshot& references);

}  // namespace core
