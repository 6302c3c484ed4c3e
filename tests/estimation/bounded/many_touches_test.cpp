// A belief that very many touches have made sharp.

#include <gtest/gtest.h>

#include "support/certified.hpp"
#include "support/touched_shape.hpp"

namespace palpate::many_touches_test {

TEST(ManyTouches, AreAnsweredByFewBins) {
  const std::vector<Hypothesis> shapes{{map_of(on_letter_l, "L"), 1.0},
                                       {map_of(on_disc, "disc"), 2.0}};
  BoundedOptions options;
  options.lattice = {.x_mm = {-6.0, 6.0, 13},
                     .y_mm = {-5.0, 6.0, 12},
                     .theta_rad = {0, two_pi, 16},
                     .pivot_mm = {2.0, -1.0}};
  // The mode's log-likelihood falls with each touch, and the bounds of large tiles lie above it by
  // ever more nats.
  constexpr std::size_t most = 100;
  const Recording recording = touches_of(on_letter_l, {{1.3, -0.8}, 0.7}, most, 811);
  const reference::Posterior truth =
      reference_posterior(shapes, options, recording.touches(0, most));
  for (const bool evidence : {false, true}) {
    SCOPED_TRACE(evidence);
    if (evidence) {
      options.evidence_nats = 0.05;
      options.evidence_range_nats = 100.0;
    }
    BoundedPosterior posterior(shapes, options);
    posterior.update(recording.touches(0, most));
    const Certified certified = expect_certified(posterior, shapes, options, truth, 1e-8);
    EXPECT_LT(certified.estimate.certificate->bins_evaluated, options.lattice.bins() / 10);
  }
}

}  // namespace palpate::many_touches_test
