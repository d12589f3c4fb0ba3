/*
 * The feature points of MPEG-4 (ISO/IEC 14496-2, Annex C) that markers of a face sit on, found from
 * their groups - brow, lid, nose, cheek, lip_upper, lip_lower, lip_corner, chin, jaw - and places.
 */
#pragma once

#include "track/layout.h"

/* Names the points of an actor's markers that have none yet. A point that no marker sits on stays
 * unnamed; what the layout names already stays. Returns how many it named. */
int actor_points_name(struct layout *layout);
