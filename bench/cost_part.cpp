#include "belief_costs.hpp"
#include "beliefs_parts.hpp"
#include "letters.hpp"

namespace palpate::bench {

Json measure_costs(const BeliefInputs& inputs, Report& report) {
  const bool quick = inputs.options.quick;
  report.add(touch_cost_case(inputs.device, inputs.letters,
                             quick ? lattice_of(30, 30, 113) : lattice_of(100, 100, 100),
                             quick ? 3 : 9));
  report.add(latency_of_averaged_case(inputs.device, inputs.letters, quick ? 20 : 300));
  report.add(plan_cost_case(inputs.device, inputs.letters, quick ? 2 : 15));
  if (!quick) {
    report.add(large_belief_case(inputs.device, inputs.letters));
  }
  return Json::array();
}

}  // namespace palpate::bench
