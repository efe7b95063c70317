  if (!(m->real[OTHER_TOLERANCE] > 0.0 && m->real[OTHER_TOLERANCE] <= ${stroke}))
    return "other_tolerance has to be above 0 and up to the stroke (${stroke} m)";
  if (!(m->real[TIME_TO_ALERT] >= 0.0 && m->real[TIME_TO_ALERT] <= ${longest}))
    return "time_to_alert has to be from 0 to ${longest} s";
  ${p}_init(&m->memory.compare, m->real[OTHER_TOLERANCE], m->real[TIME_TO_ALERT]);
  m->whole[1] = ${unchecked};
