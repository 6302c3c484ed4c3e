#pragma once

// The whole public interface but palpate/vulkan_device.hpp. Neither Vulkan nor HDF5 is needed to
// include it.
//
// Threads: different objects may be used at the same time, also where they share a Device or are
// copies of each other; an object that is being changed is for one thread at a time. Functions may
// be called from any thread, those that read and write files included: in HDF5 they take turns.
// Programs that call HDF5 themselves need a libhdf5 that was built thread-safe, as Debian's is.

#include "palpate/api.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/contact.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/device.hpp"
#include "palpate/drawn_map.hpp"
#include "palpate/error.hpp"
#include "palpate/estimate.hpp"
#include "palpate/files.hpp"
#include "palpate/fit.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/lattice.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/log.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"
#include "palpate/simulation.hpp"
#include "palpate/touch.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"
