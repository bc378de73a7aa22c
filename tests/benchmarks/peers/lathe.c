/* The two-axis lathe of the benchmark, written by hand: the same loop, the same numbers, in plain C.

   Written for the benchmark alone, as a floor for the compiled engine. What the work's program does not use is left out (arcs,
   dwells, facing), which favours this file. Build: gcc -O2 -ffp-contract=off -shared -fPIC.
   The fields of Parameters are filled by name, with "__" for ".". */

#include "elementary.h"

typedef struct {
    double interpolator__rapid_speed;
    double x_encoder__resolution, z_encoder__resolution;
    double x_controller__proportional, x_controller__integral, x_controller__derivative_gain;
    double z_controller__proportional, z_controller__integral, z_controller__derivative_gain;
    double x_dac__bits, x_dac__smallest_voltage, x_dac__largest_voltage;
    double z_dac__bits, z_dac__smallest_voltage, z_dac__largest_voltage;
    double x_axis__gain, x_axis__time_constant, x_axis__disturbance_gain;
    double z_axis__gain, z_axis__time_constant, z_axis__disturbance_gain;
    double cross_coupling__proportional, cross_coupling__integral, cross_coupling__derivative_gain, cross_coupling__largest_voltage;
    double tachometer__gain, tachometer__noise, tachometer__bias, tachometer__ripple, tachometer__ripples;
    double tachometer_adc__bits, tachometer_adc__smallest_voltage, tachometer_adc__largest_voltage;
    double spindle_controller__proportional, spindle_controller__integral, spindle_controller__derivative_gain;
    double spindle_dac__bits, spindle_dac__smallest_voltage, spindle_dac__largest_voltage;
    double spindle__gain, spindle__time_constant, spindle__disturbance_gain;
    double stock__stock_radius, stock__stock_length, stock__face, stock__free_end;
    double cutting__slowest_spindle;
    double cutting_force__cutting_pressure, cutting_force__cutting_feed_exponent, cutting_force__cutting_depth_exponent;
    double cutting_force__cutting_speed_exponent, cutting_force__thrust_pressure, cutting_force__thrust_feed_exponent;
    double cutting_force__thrust_depth_exponent, cutting_force__thrust_speed_exponent, cutting_force__lead_angle;
    double cutting_force__slowest_cutting_speed;
    double load__slowest_feed, load__slowest_spindle;
    double tool_wear__taylor_constant, tool_wear__taylor_exponent, tool_wear__wear_at_end_of_life, tool_wear__force_growth;
    double tool_wear__slowest_cutting_speed;
    double dynamometer__gain, dynamometer__bias, dynamometer__noise;
    double dynamometer_adc__bits, dynamometer_adc__smallest_voltage, dynamometer_adc__largest_voltage;
    double process_controller__reference, process_controller__force_gain, process_controller__feed_exponent;
    double process_controller__depth_exponent, process_controller__speed_exponent, process_controller__depth_of_cut;
    double process_controller__cutting_speed, process_controller__time_constant, process_controller__smallest_feed;
    double process_controller__largest_feed;
    double surface_finish__nose_radius;
} Parameters;

enum { KIND, LENGTH, START_X, START_Z, END_X, END_Z, FEED = 11, SPINDLE_MODE = 13, SPINDLE_SPEED = 14, COLUMNS = 19 };
static const double TURN = 2.0 * M_PI;
enum { CELLS = 2000, FINISH_CELLS = 600, CHANNELS = 30, STATES = 6 };

typedef struct { double depth, feed, speed, radius, contact; } Cut;
typedef struct { double cutting, longitudinal, radial; } Force;
typedef struct { double x, z, torque; } Load;
typedef struct { double voltage, error, sum, started; } Controller;
typedef struct { double x_volts, z_volts, spindle_volts, uncut, standing, wear_factor, cutting_block, lead_sine, lead_cosine; } Held;

static double nearest_level(double voltage, double low, double high, double bits)
{
    double quantum = (high - low) / (pow(2.0, bits) - 1.0);
    if (voltage <= low || quantum <= 0.0) return low;
    if (voltage >= high) return high;
    return low + floor((voltage - low) / quantum + 0.5) * quantum;
}

static double count(double position, double resolution)
{
    if (resolution <= 0.0) return position;
    return resolution * floor(position / resolution + 0.5);
}

static void control(Controller *c, double reference, double measured, double correction, double kp, double ki, double kd, double low,
                    double high, double period)
{
    double error = reference - measured;
    double slope = c->started > 0.5 ? (error - c->error) / period : 0.0;
    double total = c->sum + error * period;
    double voltage = kp * error + ki * total + kd * slope + correction;
    double growth = ki * error;
    if ((voltage > high && growth > 0.0) || (voltage < low && growth < 0.0)) {
        total = c->sum;
        voltage = kp * error + ki * total + kd * slope + correction;
    }
    if (voltage > high) voltage = high;
    if (voltage < low) voltage = low;
    c->voltage = voltage;
    c->error = error;
    c->sum = total;
    c->started = 1.0;
}

static int takes_time(const double *path, int row)
{
    return path[row * COLUMNS + KIND] <= 2.0 && path[row * COLUMNS + LENGTH] > 0.0;
}

static int next_row(const double *path, int rows, int row)
{
    for (row++; row < rows && !takes_time(path, row); row++) {}
    return row;
}

static double on_path(const double *segment, double travelled, int start, int end)
{
    double length = segment[LENGTH];
    if (segment[KIND] > 2.0 || length <= 0.0 || travelled <= 0.0) return segment[start];
    if (travelled >= length) return segment[end];
    return segment[start] + (segment[end] - segment[start]) * (travelled / length);
}

static Cut cut(const Parameters *p, const Held *held, const double *s)
{
    double x = s[1], x_velocity = s[0], z_velocity = s[2], turning = fabs(s[4]);
    double radius = x > 0.0 ? x : 0.0;
    Cut c = {0.0, 0.0, turning * radius, radius, 0.0};
    if (!(held->standing > x) || held->cutting_block < 0.5) return c;
    c.depth = held->uncut - x;
    if (c.depth < 0.0) c.depth = 0.0;
    if (turning > p->cutting__slowest_spindle) {
        double along = sqrt(x_velocity * x_velocity + z_velocity * z_velocity);
        double bound = 1.4142135623730951 * fabs(z_velocity);
        c.feed = 2.0 * M_PI / turning * (along < bound ? along : bound);
    }
    c.contact = 1.0;
    return c;
}

static Force force(const Parameters *p, const Cut *c, const Held *held)
{
    Force f = {0.0, 0.0, 0.0};
    if (c->contact < 0.5 || c->depth <= 0.0 || c->feed <= 0.0 || c->speed < p->cutting_force__slowest_cutting_speed) return f;
    double log_feed = own_log2(c->feed * 1.0e3), log_depth = own_log2(c->depth * 1.0e3), log_speed = own_log2(c->speed * 60.0);
    double thrust = held->wear_factor * p->cutting_force__thrust_pressure * 1.0e-6
                  * own_exp2((1.0 + p->cutting_force__thrust_feed_exponent) * log_feed
                         + (1.0 + p->cutting_force__thrust_depth_exponent) * log_depth
                         + p->cutting_force__thrust_speed_exponent * log_speed);
    f.cutting = held->wear_factor * p->cutting_force__cutting_pressure * 1.0e-6
              * own_exp2((1.0 + p->cutting_force__cutting_feed_exponent) * log_feed
                     + (1.0 + p->cutting_force__cutting_depth_exponent) * log_depth
                     + p->cutting_force__cutting_speed_exponent * log_speed);
    f.longitudinal = thrust * held->lead_sine;
    f.radial = thrust * held->lead_cosine;
    return f;
}

static Load load(const Parameters *p, const Cut *c, const Force *f, const double *s)
{
    double slowest = p->load__slowest_feed, spindle = s[4];
    double along = sqrt(s[0] * s[0] + s[2] * s[2] + slowest * slowest);
    double feed_x = s[0] / along, feed_z = s[2] / along, away_x = -feed_z, away_z = feed_x;
    if (away_x + (p->stock__free_end >= 0.0 ? away_z : -away_z) < 0.0) {
        away_x = feed_z;
        away_z = -feed_x;
    }
    double torque = c->radius * f->cutting;
    torque = torque * spindle / sqrt(spindle * spindle + p->load__slowest_spindle * p->load__slowest_spindle);
    Load l = {f->longitudinal * feed_x - f->radial * away_x, f->longitudinal * feed_z - f->radial * away_z, torque};
    return l;
}

static void rates(const Parameters *p, const Held *held, const double *s, double *rate)
{
    Cut c = cut(p, held, s);
    Force f = force(p, &c, held);
    Load l = load(p, &c, &f, s);
    rate[0] = (p->x_axis__gain * held->x_volts - p->x_axis__disturbance_gain * l.x - s[0]) / p->x_axis__time_constant;
    rate[1] = s[0];
    rate[2] = (p->z_axis__gain * held->z_volts - p->z_axis__disturbance_gain * l.z - s[2]) / p->z_axis__time_constant;
    rate[3] = s[2];
    rate[4] = (p->spindle__gain * held->spindle_volts - p->spindle__disturbance_gain * l.torque - s[4]) / p->spindle__time_constant;
    rate[5] = s[4];
}

static double controlled_feed(const Parameters *p, double measured, double programmed, double cutting_block, double held, double period)
{
    double smallest = p->process_controller__smallest_feed, largest = p->process_controller__largest_feed;
    double alpha = p->process_controller__feed_exponent, theta, u, feed;
    if (cutting_block < 0.5) return -1.0;
    if (held < 0.0) return programmed > largest ? largest : programmed < smallest ? smallest : programmed;
    theta = p->process_controller__force_gain * pow(p->process_controller__depth_of_cut / 1.0e-3, p->process_controller__depth_exponent)
          * pow(p->process_controller__cutting_speed / (1000.0 / 60.0), p->process_controller__speed_exponent);
    u = pow(held / 1.0e-3, alpha) + period * (p->process_controller__reference - measured) / (p->process_controller__time_constant * theta);
    if (u <= 0.0) return smallest;
    if (own_log(u) / alpha > own_log(largest / 1.0e-3)) return largest;
    feed = 1.0e-3 * pow(u, 1.0 / alpha);
    return feed > largest ? largest : feed < smallest ? smallest : feed;
}

static double standing_at(const double *removed, int cell, double radius)
{
    return cell < 0 || cell >= CELLS ? 0.0 : radius - removed[cell];
}

int lathe(const Parameters *p, const double *path, int rows, const double *tachometer_noise, const double *dynamometer_noise, int samples,
          double period, double step, int steps, double *record)
{
    double s[STATES] = {0.0}, removed[CELLS] = {0.0}, finish[FINISH_CELLS] = {0.0};
    double travelled = 0.0, samples_left = 0.0, planned_speed = -1.0, path_speed = 0.0, coupling_sum = 0.0, coupling_before = 0.0;
    double x_before = 0.0, z_before = 0.0, used = 0.0, half = 0.5 * step, sixth = step / 6.0, feed_command = -1.0;
    int row = 0, at_end = 0, started = 0, done = 0, k;
    Controller x_control = {0}, z_control = {0}, spindle_control = {0};
    Held held = {.lead_sine = sin(p->cutting_force__lead_angle), .lead_cosine = cos(p->cutting_force__lead_angle)};
    for (k = 0; k < samples; k++) {
        /* interpolator */
        if (!started) {
            at_end = !takes_time(path, 0);
        } else if (!done) {
            if (at_end) {
                row = next_row(path, rows, row);
                travelled = 0.0;
                samples_left = 0.0;
                planned_speed = -1.0;
            }
            const double *now = path + row * COLUMNS;
            double length = now[LENGTH], wanted = p->interpolator__rapid_speed;
            if (now[KIND] != 0.0) wanted = feed_command < 0.0 ? now[FEED] : feed_command * fabs(s[4]) / TURN;
            double way = wanted * period;
            int steady = fabs(wanted - planned_speed) <= 1e-9 * wanted;
            at_end = 0;
            if (!steady || samples_left < 0.5) {
                double rest = ceil((length - travelled) / way - 1.0e-6);
                if (rest < 1.0) rest = 1.0;
                samples_left = planned_speed >= 0.0 && !steady && rest > 4.0 ? 0.0 : rest;
                planned_speed = wanted;
            }
            if (samples_left > 0.5) {
                way = (length - travelled) / samples_left;
                samples_left -= 1.0;
                at_end = samples_left < 0.5;
            }
            path_speed = way / period;
            travelled = at_end ? length : travelled + way;
            done = at_end && next_row(path, rows, row) >= rows;
        }
        const double *segment = path + row * COLUMNS;
        int motion = row;
        while (motion >= 0 && !takes_time(path, motion)) motion--;
        if (motion < 0) for (motion = row; motion < rows - 1 && !takes_time(path, motion); motion++) {}
        const double *moving = path + motion * COLUMNS;
        double x_reference = on_path(segment, travelled, START_X, END_X), z_reference = on_path(segment, travelled, START_Z, END_Z);
        double direction_x = 0.0, direction_z = 0.0;
        if (moving[LENGTH] > 0.0) {
            direction_x = (moving[END_X] - moving[START_X]) / moving[LENGTH];
            direction_z = (moving[END_Z] - moving[START_Z]) / moving[LENGTH];
        }
        double cutting_block = segment[KIND] == 1.0, spindle_reference = segment[SPINDLE_MODE] == 1.0 ? segment[SPINDLE_SPEED] : 0.0;
        double programmed = cutting_block > 0.5 && spindle_reference != 0.0 ? path_speed * 2.0 * M_PI / fabs(spindle_reference) : 0.0;
        /* encoders, stock */
        double x_counted = count(s[1], p->x_encoder__resolution), z_counted = count(s[3], p->z_encoder__resolution);
        double x = s[1], z = s[3], width = p->stock__stock_length / CELLS, radius = p->stock__stock_radius;
        if (!started) {
            x_before = x;
            z_before = z;
        }
        double here = (z - p->stock__face) / width, there = (z_before - p->stock__face) / width;
        int cell = (int)floor(here), inside = z >= p->stock__face && z <= p->stock__face + p->stock__stock_length;
        if (cell >= CELLS && inside) cell = CELLS - 1;
        int low = (int)floor((here < there ? here : there) + 0.5), high = (int)floor((here < there ? there : here) - 0.5), i;
        if (low < 0) low = 0;
        if (high > CELLS - 1) high = CELLS - 1;
        for (i = low; i <= high; i++) {
            double share = here - there != 0.0 ? (i + 0.5 - there) / (here - there) : 1.0;
            double tip = x_before + share * (x - x_before);
            if (tip < 0.0) tip = 0.0;
            if (radius - removed[i] > tip) removed[i] = radius - tip;
        }
        held.uncut = held.standing = 0.0;
        if (inside) {
            double left = standing_at(removed, cell - 1, radius), right = standing_at(removed, cell + 1, radius);
            double middle = standing_at(removed, cell, radius);
            held.standing = left > right ? left : right;
            if (middle > held.standing) held.standing = middle;
            held.uncut = z > z_before ? right : z < z_before ? left : held.standing;
            if (held.uncut == 0.0) held.uncut = middle;
        }
        x_before = x;
        z_before = z;
        held.cutting_block = cutting_block;
        /* tachometer and its converter */
        double volts = p->tachometer__gain * s[4] + p->tachometer__bias + p->tachometer__noise * tachometer_noise[k]
                     + p->tachometer__ripple * sin(p->tachometer__ripples * s[5]);
        double reading = nearest_level(volts, p->tachometer_adc__smallest_voltage, p->tachometer_adc__largest_voltage,
                                       p->tachometer_adc__bits) / p->tachometer__gain;
        /* contour error, sensed and actual; cross coupling */
        double deviation = (x_reference - x_counted) * direction_z - (z_reference - z_counted) * direction_x;
        double contour = (x_reference - x) * direction_z - (z_reference - z) * direction_x;
        double slope = started ? (deviation - coupling_before) / period : 0.0, total = coupling_sum + deviation * period;
        double bound = p->cross_coupling__largest_voltage, ki = p->cross_coupling__integral;
        double coupling = p->cross_coupling__proportional * deviation + ki * total + p->cross_coupling__derivative_gain * slope;
        if (fabs(coupling) > bound && coupling * ki * deviation > 0.0) {
            total = coupling_sum;
            coupling = p->cross_coupling__proportional * deviation + ki * total + p->cross_coupling__derivative_gain * slope;
        }
        coupling = coupling > bound ? bound : coupling < -bound ? -bound : coupling;
        coupling_sum = total;
        coupling_before = deviation;
        /* cut, wear, roughness, dynamometer */
        Cut c = cut(p, &held, s);
        if (c.contact >= 0.5 && c.speed >= p->tool_wear__slowest_cutting_speed) {
            double logarithm = own_log(p->tool_wear__taylor_constant / c.speed) / p->tool_wear__taylor_exponent;
            logarithm = logarithm > 60.0 ? 60.0 : logarithm < -60.0 ? -60.0 : logarithm;
            used += period / (60.0 * own_exp(logarithm));
        }
        double wear = p->tool_wear__wear_at_end_of_life * used, roughness = 0.0;
        held.wear_factor = 1.0 + p->tool_wear__force_growth * wear;
        if (c.contact >= 0.5) {
            double place = (z - p->stock__face) / p->stock__stock_length * FINISH_CELLS;
            roughness = programmed * programmed / (32.0 * p->surface_finish__nose_radius);
            if (0.0 <= place && place < FINISH_CELLS) finish[(int)floor(place)] = roughness;
        }
        Force f = force(p, &c, &held);
        Load l = load(p, &c, &f, s);
        double force_volts = p->dynamometer__gain * f.cutting + p->dynamometer__bias + p->dynamometer__noise * dynamometer_noise[k];
        double force_seen = nearest_level(force_volts, p->dynamometer_adc__smallest_voltage, p->dynamometer_adc__largest_voltage,
                                          p->dynamometer_adc__bits) / p->dynamometer__gain;
        feed_command = controlled_feed(p, force_seen, programmed, cutting_block, feed_command, period);
        /* controllers and converters */
        control(&x_control, x_reference, x_counted, coupling * direction_z, p->x_controller__proportional, p->x_controller__integral,
                p->x_controller__derivative_gain, p->x_dac__smallest_voltage, p->x_dac__largest_voltage, period);
        control(&z_control, z_reference, z_counted, coupling * -direction_x, p->z_controller__proportional, p->z_controller__integral,
                p->z_controller__derivative_gain, p->z_dac__smallest_voltage, p->z_dac__largest_voltage, period);
        control(&spindle_control, spindle_reference, reading, 0.0, p->spindle_controller__proportional, p->spindle_controller__integral,
                p->spindle_controller__derivative_gain, p->spindle_dac__smallest_voltage, p->spindle_dac__largest_voltage, period);
        held.x_volts = nearest_level(x_control.voltage, p->x_dac__smallest_voltage, p->x_dac__largest_voltage, p->x_dac__bits);
        held.z_volts = nearest_level(z_control.voltage, p->z_dac__smallest_voltage, p->z_dac__largest_voltage, p->z_dac__bits);
        held.spindle_volts = nearest_level(spindle_control.voltage, p->spindle_dac__smallest_voltage, p->spindle_dac__largest_voltage,
                                           p->spindle_dac__bits);
        started = 1;
        double values[CHANNELS] = {
            x_reference, z_reference, path_speed, spindle_reference, row, cutting_block,
            x_counted, x_control.error, held.x_volts, x, s[0], z_counted, z_control.error, held.z_volts, z, s[2],
            coupling, contour, reading, held.spindle_volts, s[4],
            c.depth, c.feed, c.speed, f.cutting, f.longitudinal, f.radial, l.torque, wear, roughness,
        };
        for (i = 0; i < CHANNELS; i++) record[k * CHANNELS + i] = values[i];
        if (done) return k + 1;
        /* RK4 */
        for (int substep = 0; substep < steps; substep++) {
            double stage_state[STATES], rate[STATES], sum[STATES] = {0.0}, reach = 0.0;
            for (i = 0; i < STATES; i++) stage_state[i] = s[i];
            for (int stage = 0; stage < 4; stage++) {
                double weight = stage == 1 || stage == 2 ? 2.0 : 1.0;
                rates(p, &held, stage_state, rate);
                reach = stage == 2 ? step : half;
                for (i = 0; i < STATES; i++) {
                    sum[i] = sum[i] + weight * rate[i];
                    stage_state[i] = s[i] + reach * rate[i];
                }
            }
            for (i = 0; i < STATES; i++) s[i] = s[i] + sixth * sum[i];
        }
    }
    return k;
}
