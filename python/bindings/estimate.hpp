#pragma once

#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "palpate/estimate.hpp"
#include "palpate/plan.hpp"
#include "session.hpp"
#include "touches.hpp"

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
/// The hypothesis that an OccupancyGrid or a Hypothesis is; none where the item is neither.
std::optional<Hypothesis> hypothesis_in(nb::handle item);

/// A filter over object and pose.
template <typename Filter>
struct Named : Owned<Filter> {
  std::string name;  ///< "A, E, I on 'llvmpipe'"
};

std::string name_of(const std::vector<Hypothesis>& hypotheses, const Session& session);

template <typename Filter, typename Options>
Named<Filter> make_filter(const std::shared_ptr<Session>& session, nb::handle maps,
                          const Options& options) {
  const std::vector<Hypothesis> hypotheses = hypotheses_of(maps);
  auto filter = make_owned<Filter>(session, [hypotheses, options](Device& device) {
    if constexpr (std::is_constructible_v<Filter, Device&, decltype(hypotheses), Options>) {
      return Filter(device, hypotheses, options);
    } else {
      return Filter(hypotheses, options);
    }
  });
  return {std::move(filter), name_of(hypotheses, *session)};
}

template <typename Filter>
void update(const Named<Filter>& self, const TouchesLike& touches, const Progress& progress) {
  TouchViews views = views_of(touches);
  self.use(std::move(views.kept), progress,
           [all = std::move(views.touches)](Filter& filter, Call& call) {
             filter.update(all, call.progress());
           });
}

/// The refined pose near a mode, by default that of estimate().
template <typename Filter>
RefinedPose refine(const Named<Filter>& self, const std::optional<Mode>& mode) {
  return self.use([mode](Filter& belief, Call&) {
    return belief.refine(mode ? *mode : belief.estimate().mode);
  });
}

}  // namespace palpate::python
