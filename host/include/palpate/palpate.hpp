#pragma once

// The whole public interface. Neither Vulkan nor HDF5 is needed to include it.

#include "palpate/balanced_lattice.hpp"
#include "palpate/contact.hpp"
#include "palpate/device.hpp"
#include "palpate/error.hpp"
#include "palpate/estimate.hpp"
#include "palpate/files.hpp"
#include "palpate/lattice.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/scene.hpp"
#include "palpate/sensor_model.hpp"
#include "palpate/simulation.hpp"
#include "palpate/touch.hpp"
