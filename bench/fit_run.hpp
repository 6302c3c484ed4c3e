#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "letters.hpp"
#include "measurement.hpp"
#include "palpate/fit.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// Shapes that nobody learned, to be told from the vowels by how badly they fit.
inline const std::vector<std::string> misfits = {"F", "H", "T", "X", "L", "C", "Z", "ring"};

/// The fits of some unknowns after a number of touches.
struct Fits {
  std::vector<double> z;
  std::array<int, 3> verdicts{};  ///< [Verdict] how many unknowns got it

  void add(const Fit& fit);
  int count(Verdict verdict) const { return verdicts[static_cast<std::size_t>(verdict)]; }
};

/// How well learned and unlearned unknowns fit after a number of touches.
struct FitRun {
  int touches = 0;
  Fits learned;
  Fits unlearned;

  /// Of all pairs of a learned and an unlearned unknown, the fraction in which the unlearned one
  /// fits worse; see told_apart() of values.
  double told_apart() const;
  Interval told_apart_interval() const;
};

/// What touches the unknowns, and how finely they are recognised.
struct FitSetting {
  std::string name;
  PoseLattice lattice;
  TrialTouches touching;
};
/// The 6 x 6 array and an array of 16 x 16 elements on a fine lattice; the 6 x 6 array on the
/// coarse lattice of Table I, and off its reported place by two amounts.
std::vector<FitSetting> fit_settings();

/// The histogram filter over the vowels, learned with the same array, after each of these numbers
/// of touches: `trials_each` unknowns of every vowel and of every misfit.
std::vector<FitRun> run_fit(Device& device, const FitSetting& setting, int trials_each,
                            std::span<const int> touches);

}  // namespace palpate::bench
