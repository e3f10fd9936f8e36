/* Fault bits: each part of the drive reports them in the period in which it finds the fault.
 *
 * Bits are append-only numbers of the fault log and the link. sequence/fault_list.def has text,
 * cause and reaction of each; the sequence latches them.
 */
#ifndef FAULT_H
#define FAULT_H

#define FAULT_OVER_CURRENT      (1u << 0)
#define FAULT_DC_OVER_VOLTAGE   (1u << 1)
#define FAULT_DC_UNDER_VOLTAGE  (1u << 2)
#define FAULT_NON_FINITE        (1u << 3) /* a state or an output is NaN or infinite */
#define FAULT_ADC_RANGE         (1u << 4) /* an ADC word at an end of its range, or beyond */
#define FAULT_CURRENT_SUM       (1u << 5) /* phase currents do not add up to zero */
#define FAULT_OVER_SPEED        (1u << 6)
#define FAULT_CONFIG            (1u << 7)  /* parameters, motor data or table refused at start */
#define FAULT_CURRENT_OFFSET    (1u << 8)  /* zero-current offset too large */
#define FAULT_TABLE_CRC         (1u << 9)  /* gain table changed in memory */
#define FAULT_PERIOD_LATE       (1u << 10) /* one control period took too long: a warning */
#define FAULT_PERIOD_OVERRUN    (1u << 11) /* two in a row did */
#define FAULT_STATOR_RESISTANCE (1u << 12) /* measured value does not fit this motor */
#define FAULT_ORIENTATION_LOST  (1u << 13) /* supervisor: the field angle is lost */
#define FAULT_OVERLOAD          (1u << 14)
#define FAULT_CURRENT_SENSOR    (1u << 15)
#define FAULT_VOLTAGE_SENSOR    (1u << 16)
#define FAULT_OPEN_PHASE        (1u << 17)
#define FAULT_EARTH_FAULT       (1u << 18)
#define FAULT_STALL             (1u << 19)
#define FAULT_OBSERVER          (1u << 20)
#define FAULT_COMMAND_TIMEOUT   (1u << 21)
#define FAULT_DERATED           (1u << 22)
#define FAULT_REGENERATION      (1u << 23)
#define FAULT_MAINS_LOST        (1u << 24)
#define FAULT_BRAKE_INPUT       (1u << 25) /* from the port: hardware comparator */
#define FAULT_STORE             (1u << 26)
#define FAULT_COMMISSIONING     (1u << 27)
#define FAULT_FLYING_START      (1u << 28)
#define FAULT_UNDERLOAD         (1u << 29) /* reserved */
#define FAULT_ADC_FROZEN        (1u << 30) /* frozen current words */
#define FAULT_SPEED_DEVIATION   (1u << 31)

#endif
