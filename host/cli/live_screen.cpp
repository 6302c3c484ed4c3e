#include "cli/live_screen.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "cli/array_picture.hpp"
#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "figures/evidence_scale.hpp"

namespace palpate::cli {

namespace {

/// A rectangle of the canvas, in character cells.
struct Panel {
  int column = 0;
  int row = 0;
  int columns = 0;
  int rows = 0;
};

/// Draws the area from `lower_mm` to `upper_mm` as large as it fits into the panel, y upwards.
/// `pixel_at(p_mm)` returns the Pixel of a point, or none.
template <typename PixelAt>
void draw_picture(TerminalCanvas& canvas, const Panel& panel, const glm::dvec2& lower_mm,
                  const glm::dvec2& upper_mm, const PixelAt& pixel_at) {
  const glm::dvec2 extent_mm = upper_mm - lower_mm;
  const double mm =
      std::max(extent_mm.x / panel.columns, extent_mm.y / (2.0 * panel.rows));  // of a pixel
  const int width = std::min(panel.columns, static_cast<int>(std::lround(extent_mm.x / mm)));
  const int height = std::min(2 * panel.rows, static_cast<int>(std::lround(extent_mm.y / mm)));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const glm::dvec2 p_mm{lower_mm.x + (u + 0.5) * extent_mm.x / width,
                            upper_mm.y - (v + 0.5) * extent_mm.y / height};
      if (const std::optional<Pixel> pixel = pixel_at(p_mm)) {
        canvas.pixel(panel.column + u, 2 * panel.row + v, *pixel);
      }
    }
  }
}

bool alive(const LiveView& view, std::size_t i) { return view.valid.empty() || view.valid[i] != 0; }

void draw_pressure(TerminalCanvas& canvas, const Panel& panel, const LiveView& view) {
  canvas.text(panel.column, panel.row,
              fmt::format("pressure, 0 to {:.3g} {}", view.full_scale, view.pressure_unit), true);
  if (view.pressure.size() != view.elements_mm.size() || view.pressure.empty()) {
    return;
  }
  const ArrayPicture array(view.elements_mm);
  draw_picture(canvas, {panel.column, panel.row + 1, panel.columns, panel.rows - 1},
               array.lower_mm(), array.upper_mm(),
               [&](const glm::dvec2& p_mm) -> std::optional<Pixel> {
                 const auto element = array.element_at(p_mm);
                 if (!element) {
                   return {};
                 }
                 if (!alive(view, *element)) {
                   return Pixel{.colour = grey, .mark = 'x'};
                 }
                 if (std::isnan(view.pressure[*element])) {
                   return Pixel{.colour = white, .mark = '?'};
                 }
                 const double part = view.pressure[*element] / view.full_scale;
                 return Pixel{.colour = sequential(part), .shade = part};
               });
}

Colour mix(const Colour& a, const Colour& b, double part) {
  return {a.red + part * (b.red - a.red), a.green + part * (b.green - a.green),
          a.blue + part * (b.blue - a.blue)};
}

/// The map's evidence at the cell nearest to a point: log odds relative to the prior, in nats.
double evidence_at(const OccupancyGrid& map, const glm::dvec2& p_mm) {
  const glm::dvec2 cell = (p_mm - map.origin_mm) / map.cell_mm;
  const int i = std::clamp(static_cast<int>(std::lround(cell.x)), 0, map.nx - 1);
  const int j = std::clamp(static_cast<int>(std::lround(cell.y)), 0, map.ny - 1);
  return map.at(i, j) - map.prior_log_odds();
}

void draw_map(TerminalCanvas& canvas, const Panel& panel, const LiveView& view) {
  if (view.map == nullptr) {
    canvas.text(panel.column, panel.row, "no touch yet", true);
    return;
  }
  canvas.text(panel.column, panel.row, "the array on the map of " + view.map->label, true);
  const OccupancyGrid& map = *view.map;
  const bool with_array = view.T_robot_sensor && view.readings.size() == view.elements_mm.size() &&
                          !view.elements_mm.empty();
  const std::vector<glm::dvec2> nowhere;
  const ArrayPicture array(with_array ? view.elements_mm : nowhere);
  const Pose T_sensor_object =
      with_array ? inverse(view.T_object_robot * *view.T_robot_sensor) : Pose{};
  draw_picture(canvas, {panel.column, panel.row + 1, panel.columns, panel.rows - 1},
               lower_edge_mm(map), upper_edge_mm(map),
               [&](const glm::dvec2& p_mm) -> std::optional<Pixel> {
                 const double part = evidence_at(map, p_mm) / view.evidence_nats;
                 Pixel pixel{.colour = diverging(part), .shade = 0.25 * std::clamp(part, 0.0, 1.0)};
                 const auto element = array.element_at(T_sensor_object * p_mm);
                 if (element && is_contact(view.readings[*element])) {
                   pixel = {.colour = ink, .mark = '@'};
                 } else if (element) {
                   pixel.colour = mix(pixel.colour, ink, 0.35);
                   pixel.mark = 'o';
                 }
                 return pixel;
               });
}

/// Indices of the `room` most probable labels, in the order of the labels.
std::vector<std::size_t> shown_labels(const LiveView& view, std::size_t room) {
  std::vector<std::size_t> shown(view.labels.size());
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  if (shown.size() > room) {
    if (!view.identity.empty()) {
      std::stable_sort(shown.begin(), shown.end(), [&](std::size_t a, std::size_t b) {
        return view.identity[a] > view.identity[b];
      });
    }
    shown.resize(room);
    std::sort(shown.begin(), shown.end());
  }
  return shown;
}

void draw_identity(TerminalCanvas& canvas, const Panel& panel, const LiveView& view) {
  constexpr int longest_label = 12;
  constexpr int number = 8;  // " 100.0 %"
  const auto shown = shown_labels(view, static_cast<std::size_t>(std::max(panel.rows, 0)));
  int width = 1;
  for (const std::size_t label : shown) {
    width = std::max(width, std::min(longest_label, static_cast<int>(view.labels[label].size())));
  }
  int row = panel.row;
  for (const std::size_t label : shown) {
    canvas.text(panel.column, row, view.labels[label]);
    // Cuts off the end of a long label.
    canvas.text(panel.column + width, row,
                std::string(static_cast<std::size_t>(panel.columns), ' '));
    if (!view.identity.empty()) {
      const double probability = view.identity[label];
      const int bar = panel.columns - width - 1 - number;
      canvas.bar(panel.column + width + 1, row, bar, probability,
                 series(label % (series_colours - 1)));
      canvas.text(panel.column + width + 1 + std::max(bar, 0), row,
                  fmt::format("{:6.1f} %", 100.0 * probability));
    }
    ++row;
  }
}

/// Draws the result first, then what there is to say of it, the state and the stream. Returns the
/// number of rows.
int draw_words(TerminalCanvas& canvas, const LiveView& view, int columns) {
  constexpr std::size_t most_notes = 3;
  std::string stream = fmt::format("{}  {:.0f} Hz  {} frames, {} lost", view.sensor, view.rate_hz,
                                   view.frames, view.lost);
  if (view.latency_ms && view.worst_latency_ms) {
    stream +=
        fmt::format("  latency {:.1f} ms, worst {:.1f}", *view.latency_ms, *view.worst_latency_ms);
  }
  int row = 0;
  const auto add = [&](const std::string& words, bool strong) {
    if (!words.empty()) {
      canvas.text(0, row++, words, strong);
    }
  };
  if (!view.pose.empty()) {
    // A long label leaves the pose its room.
    const int room = columns - static_cast<int>(view.pose.size()) - 2;
    const std::size_t object = static_cast<std::size_t>(std::max(room, 0));
    add((room > 0 ? shorten_middle(view.object, object) + ": " : "") + view.pose, true);
  }
  add(view.next, false);
  add(view.truth, false);
  for (std::size_t i = 0; i < std::min(view.notes.size(), most_notes); ++i) {
    add(view.notes[i], true);
  }
  add(view.state, view.warning);
  add(stream, false);
  return row;
}

}  // namespace

LiveScreen::LiveScreen(std::FILE* output, const SensorDescription& sensor,
                       const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
                       std::optional<PlanGoal> plan, const std::string& page)
    : output_(output), task_(task), plan_(plan) {
  view_.sensor = sensor.serial.empty() ? sensor.name : sensor.name + " " + sensor.serial;
  view_.elements_mm = elements_mm;
  view_.valid = sensor.valid;
  view_.pressure_unit = sensor.pressure_unit;
  view_.labels = task.labels;
  std::vector<OccupancyGrid> maps;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    maps.push_back(hypothesis.map);
  }
  view_.evidence_nats = evidence_scale(maps).range_nats;
  if (terminal_moves_cursor()) {
    terminal_.emplace(fileno(output), STDIN_FILENO);
    view_.keys = terminal_->has_keys() ? "r: next unknown   Ctrl-C: end" : "Ctrl-C: end";
    view_.keys += page.empty() ? "" : "   " + page;
  }
}

bool LiveScreen::update(const LiveState& state, const std::string& warning) {
  describe(state);
  if (!warning.empty()) {
    view_.warning = true;
    view_.state += "; " + warning;
  }
  view_.rate_hz = rate_.hz(state.counters.frames);
  const Terminal::Size size = Terminal::size_of(fileno(output_));
  if (terminal_) {
    terminal_->show(draw(view_, size.columns, size.rows, colours_));
    return terminal_->keys().find('r') != std::string::npos;
  }
  if (state.all_touches != printed_) {
    printed_ = state.all_touches;
    for (const std::string& line : draw(view_, size.columns - 1, size.rows - 1, colours_)) {
      fmt::print(output_, "{}\n", line);
    }
    std::fflush(output_);
  }
  return false;
}

void LiveScreen::describe(const LiveState& state) {
  view_.frames = state.counters.frames;
  view_.lost = state.counters.lost;
  view_.warning = state.gone || state.taring;
  view_.state = state.gone     ? "the board is unplugged; plug it in again to go on"
                : state.taring ? "taring: do not touch the array"
                               : fmt::format("unknown {}, {} touches{}", state.unknown + 1,
                                             state.touches, state.touching ? ", touching" : "");
  if (state.without_pose > 0) {
    view_.warning = true;
    view_.state += fmt::format("; skipped {} touches without a pose", state.without_pose);
  }
  view_.pressure = state.pressure;
  // Most presses are several times as strong as the contact threshold. A touch may widen the scale;
  // a single frame may not, because a reading of 1e38 would leave nothing else to be seen.
  view_.full_scale = std::max(5.0 * task_.classifier().threshold, 1e-6);
  if (state.last) {
    for (const double pressure : state.last->touch.pressure) {
      view_.full_scale = std::max(view_.full_scale, pressure);
    }
  }
  view_.pose.clear();
  view_.truth.clear();
  view_.next.clear();
  view_.notes.clear();
  view_.identity.clear();
  view_.map = nullptr;
  view_.latency_ms.reset();
  view_.T_robot_sensor.reset();
  if (!state.last) {
    return;
  }
  const RecognitionStep& step = state.last->step;
  if (step.contradicted) {
    view_.state += "; no map fits these touches";
    view_.warning = true;
  }
  view_.object = identity_words(step, task_);
  view_.pose = pose_words(pose_text(step));
  view_.truth = truth_words(step);
  if (plan_) {
    view_.next = state.last->next ? next_touch_words(*state.last->next, *plan_) : "planning";
  }
  if (const auto decision = decision_words(step); !decision.empty()) {
    view_.notes.push_back(decision);
  }
  if (const auto unproven = unproven_sentence(step, task_); !unproven.empty()) {
    view_.notes.push_back(unproven);
  } else if (const std::string dropped = dropped_text(step); !dropped.empty()) {
    view_.state += "; dropped " + dropped;
  }
  if (const auto misfit = misfit_sentence(step, state.touches, task_); !misfit.empty()) {
    view_.notes.push_back(misfit);
    view_.state += step.known ? fmt::format("; known {:.2f}", *step.known) : "";
  } else if (step.fit) {
    view_.state += "; " + fit_words(step);
  }
  if (const std::string surprise = surprise_text(step); !surprise.empty()) {
    view_.state += "; surprise " + surprise;
  }
  if (auto words = single_touch_words(task_, state.touches); !words.empty()) {
    view_.notes.push_back(std::move(words));
  }
  std::ranges::move(warning_words(step), std::back_inserter(view_.notes));
  view_.identity = step.identity;
  view_.map = &task_.hypotheses[step.mode.object].map;
  view_.T_object_robot = step.pose();
  view_.latency_ms = state.last->latency_ms;
  view_.worst_latency_ms = state.worst_latency_ms;
  place_array(state);
}

void LiveScreen::place_array(const LiveState& state) {
  const bool now = state.touching && state.T_robot_sensor;
  view_.T_robot_sensor = now ? state.T_robot_sensor : state.last->touch.T_robot_sensor;
  view_.readings = state.last->readings;
  if (now) {
    const Touch touch{.T_robot_sensor = *view_.T_robot_sensor,
                      .elements_mm = view_.elements_mm,
                      .pressure = state.pressure,
                      .valid = view_.valid};
    view_.readings = task_.classifier().classify(touch);
  }
}

std::vector<std::string> draw(const LiveView& view, int columns, int rows,
                              TerminalColours colours) {
  constexpr int least_columns = 44;
  constexpr int least_body = 9;
  constexpr int gap = 2;
  TerminalCanvas canvas(columns, rows);
  const int top = draw_words(canvas, view, columns) + 1;
  if (columns < least_columns || rows - top - 2 < least_body) {
    draw_identity(canvas, {0, top, columns, rows - top}, view);
    return canvas.lines(colours);
  }
  const int body = rows - top - 2;
  const int left = std::clamp(columns * 2 / 5, 20, 60);
  const int bars = std::min(static_cast<int>(view.labels.size()), std::max(3, body / 2));
  const int picture = body - bars - 2;
  draw_pressure(canvas, {0, top, left, picture}, view);
  canvas.text(0, top + picture + 1, "identity", true);
  draw_identity(canvas, {0, top + picture + 2, left, bars}, view);
  draw_map(canvas, {left + gap, top, columns - left - gap, body}, view);
  canvas.text(0, rows - 1, view.keys);
  return canvas.lines(colours);
}

}  // namespace palpate::cli
