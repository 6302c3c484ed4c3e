#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "bounded_parts.hpp"
#include "dense_posterior.hpp"
#include "letters.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t seed = 1'404'000'000;
constexpr std::array touches{3, 9};

/// What certificates promised and what was measured, over trials.
struct Checks {
  std::vector<CertificateCheck> all;

  double largest(double CertificateCheck::*field) const {
    return (*std::ranges::max_element(all, {}, field)).*field;
  }
  int count(bool CertificateCheck::*field) const {
    return static_cast<int>(std::ranges::count(all, true, field));
  }
};

void add_case(const PoseLattice& lattice, int after, const Checks& checks, Report& report) {
  const std::size_t trials = checks.all.size();
  const auto broken = std::ranges::count_if(
      checks.all, [](const CertificateCheck& check) { return !check.holds(); });
  report.add(
      {.name = fmt::format("accuracy {}, touch {}", size_of(lattice), after),
       .facts = {{"posteriors", trials}},
       .measurements = {
           {"certificates broken", static_cast<double>(broken), "posteriors", at_most(0.0)},
           {"certificate, largest", checks.largest(&CertificateCheck::promised), "mass",
            at_most(BoundedOptions{}.tolerance)},
           {"mass not counted, largest", checks.largest(&CertificateCheck::mass_outside), "mass"},
           {"total variation of marginals, largest",
            checks.largest(&CertificateCheck::total_variation), "mass"},
           {"identity error, largest", checks.largest(&CertificateCheck::identity_error),
            "probability", at_most(BoundedOptions{}.tolerance)},
           share_of("the dense posterior's mode", checks.count(&CertificateCheck::same_mode),
                    trials, at_least(100.0))}});
}

Json record_of(const PoseLattice& lattice, int after, const Checks& checks) {
  Json record{{"bins", size_of(lattice)}, {"touches", after}};
  for (const CertificateCheck& check : checks.all) {
    record["promised"].push_back(check.promised);
    record["mass_outside"].push_back(check.mass_outside);
    record["total_variation"].push_back(check.total_variation);
    record["identity_error"].push_back(check.identity_error);
    record["same_mode"].push_back(check.same_mode);
    record["holds"].push_back(check.holds());
  }
  return record;
}

}  // namespace

Json measure_bounded_accuracy(const BoundedInputs& inputs, Report& report) {
  std::vector<PoseLattice> lattices = {lattice_of(5, 5, 4), lattice_of(10, 10, 10)};
  if (!inputs.options.quick) {
    lattices.insert(lattices.end(),
                    {lattice_of(25, 25, 16), lattice_of(44, 44, 52), lattice_of(100, 100, 100)});
  }
  const std::vector<Recording> trials =
      make_trials(vowels, inputs.options.quick ? 1 : 10, touches.back(), seed);
  Json records = Json::array();
  for (const PoseLattice& lattice : lattices) {
    BoundedPosterior bounded(inputs.letters, {.lattice = lattice});
    PoseHistogram histogram(inputs.device, inputs.letters, {.lattice = lattice});
    std::array<Checks, touches.size()> checks;
    for (const Recording& trial : trials) {
      bounded.reset();
      histogram.reset();
      std::size_t done = 0;
      for (std::size_t i = 0; i < touches.size(); ++i) {
        const auto until = static_cast<std::size_t>(touches[i]);
        bounded.update(trial.touches(done, until));
        histogram.update(trial.touches(done, until));
        done = until;
        checks[i].all.push_back(check_certificate(
            bounded,
            dense_posterior(histogram, inputs.letters, ContactModel{}, trial.touches(0, until))));
      }
    }
    for (std::size_t i = 0; i < touches.size(); ++i) {
      add_case(lattice, touches[i], checks[i], report);
      records.push_back(record_of(lattice, touches[i], checks[i]));
    }
  }
  return records;
}

}  // namespace palpate::bench
