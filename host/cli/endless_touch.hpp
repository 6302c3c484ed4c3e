#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/stream_time.hpp"
#include "palpate/touch_detector.hpp"

namespace palpate::cli {

/// Watches a stream for a last touch that does not end, and for the elements that hold it.
class EndlessTouch {
 public:
  /// @param release of the touch detector
  explicit EndlessTouch(double release) : release_(release) {}

  /// Takes a frame that the detector has just taken.
  void add(const Frame& frame, const TouchDetector& detector);

  /// Returns what never releases and the remedy, as a sentence; "" where all touches end. The last
  /// touch counts as endless where it goes on to the end of the stream and over more than half of
  /// the frames. The only touch of a stream, which may just be cut short, counts where it goes over
  /// more than nine tenths.
  std::string complaint(const std::string& pressure_unit, const std::string& remedy) const;

 private:
  double release_;
  StreamTime time_;
  std::uint64_t frames_ = 0;
  std::vector<std::uint64_t> held_;  ///< [e] frames since the element was last below the release
  std::uint64_t touched_ = 0;        ///< frames of the touch under way
  double onset_s_ = 0.0;             ///< its onset, since the first frame
  bool released_before_ = false;     ///< an earlier touch has ended
};

}  // namespace palpate::cli
