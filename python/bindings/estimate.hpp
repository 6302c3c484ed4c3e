#pragma once

#include <memory>
#include <vector>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "palpate/estimate.hpp"
#include "palpate/plan.hpp"
#include "session.hpp"

namespace palpate::python {

/// Gains of every candidate.
struct TouchGains {
  std::vector<TouchGain> each;
};

/// Maps, as OccupancyGrid or Hypothesis.
struct MapsLike : nb::object {
  NB_OBJECT_DEFAULT(MapsLike, nb::object, "collections.abc.Iterable[OccupancyGrid | Hypothesis]",
                    any_object)
};
std::vector<Hypothesis> hypotheses_of(nb::handle maps);

/// A filter, and the labels of its hypotheses, for the text of it.
template <typename Filter>
struct Named : Owned<Filter> {
  Named(Owned<Filter> filter, std::vector<std::string> names)
      : Owned<Filter>(std::move(filter)), labels(std::move(names)) {}
  std::vector<std::string> labels;
};

std::vector<std::string> labels_of(const std::vector<Hypothesis>& hypotheses);
/// "A, E, I on 'llvmpipe'"
std::string text_of(const std::vector<std::string>& labels, const Session& session);

}  // namespace palpate::python
