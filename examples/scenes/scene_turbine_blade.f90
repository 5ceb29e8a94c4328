!> The blade of the NREL 5-MW reference turbine: J. Jonkman, S. Butterfield, W. Musial, G. Scott, Definition of a 5-MW
!> Reference Wind Turbine for Offshore System Development, NREL/TP-500-38060 (2009), tables 2-1 and 3-1.
module scene_turbine_blade
   use kschur, only: wp
   implicit none
   private
   public :: chord, lumped, section, tributary

   !> Stations of a blade.
   integer, parameter, public :: stations = 49
   !> Length of a blade, m.
   real(wp), parameter, public :: blade_length = 61.5_wp

   !> Rows of `blade`.
   integer, parameter, public :: place = 1, twist = 2, mass = 3, flap = 4, edge = 5, torsion = 6, axial = 7, &
      flap_inertia = 8, edge_inertia = 9
   ! The report's factor on the mass. There a blade weighs 17,740 kg, integrated over 17 elements; here 0.7 % less.
   real(wp), parameter :: mass_factor = 1.04536_wp

   ! A column for each station: fraction of the length; structural twist (degrees); mass (kg/m); flapwise and
   ! edgewise bending stiffness, torsional stiffness (10^6 N m^2); axial stiffness (10^6 N); flapwise and edgewise
   ! mass moment of inertia (kg m).
   real(wp), parameter :: blade(9, stations) = reshape([ &
      0.0_wp, 13.308_wp, 678.935_wp, 18110.0_wp, 18113.6_wp, 5564.4_wp, 9729.48_wp, 972.86_wp, 973.04_wp, &
      0.00325_wp, 13.308_wp, 678.935_wp, 18110.0_wp, 18113.6_wp, 5564.4_wp, 9729.48_wp, 972.86_wp, 973.04_wp, &
      0.01951_wp, 13.308_wp, 773.363_wp, 19424.9_wp, 19558.6_wp, 5431.59_wp, 10789.5_wp, 1091.52_wp, 1066.38_wp, &
      0.03577_wp, 13.308_wp, 740.55_wp, 17455.9_wp, 19497.8_wp, 4993.98_wp, 10067.23_wp, 966.09_wp, 1047.36_wp, &
      0.05203_wp, 13.308_wp, 740.042_wp, 15287.4_wp, 19788.8_wp, 4666.59_wp, 9867.78_wp, 873.81_wp, 1099.75_wp, &
      0.06829_wp, 13.308_wp, 592.496_wp, 10782.4_wp, 14858.5_wp, 3474.71_wp, 7607.86_wp, 648.55_wp, 873.02_wp, &
      0.08455_wp, 13.308_wp, 450.275_wp, 7229.72_wp, 10220.6_wp, 2323.54_wp, 5491.26_wp, 456.76_wp, 641.49_wp, &
      0.10081_wp, 13.308_wp, 424.054_wp, 6309.54_wp, 9144.7_wp, 1907.87_wp, 4971.3_wp, 400.53_wp, 593.73_wp, &
      0.11707_wp, 13.308_wp, 400.638_wp, 5528.36_wp, 8063.16_wp, 1570.36_wp, 4493.95_wp, 351.61_wp, 547.18_wp, &
      0.13335_wp, 13.308_wp, 382.062_wp, 4980.06_wp, 6884.44_wp, 1158.26_wp, 4034.8_wp, 316.12_wp, 490.84_wp, &
      0.14959_wp, 13.308_wp, 399.655_wp, 4936.84_wp, 7009.18_wp, 1002.12_wp, 4037.29_wp, 303.6_wp, 503.86_wp, &
      0.16585_wp, 13.308_wp, 426.321_wp, 4691.66_wp, 7167.68_wp, 855.9_wp, 4169.72_wp, 289.24_wp, 544.7_wp, &
      0.18211_wp, 13.181_wp, 416.82_wp, 3949.46_wp, 7271.66_wp, 672.27_wp, 4082.35_wp, 246.57_wp, 569.9_wp, &
      0.19837_wp, 12.848_wp, 406.186_wp, 3386.52_wp, 7081.7_wp, 547.49_wp, 4085.97_wp, 215.91_wp, 601.28_wp, &
      0.21465_wp, 12.192_wp, 381.42_wp, 2933.74_wp, 6244.53_wp, 448.84_wp, 3668.34_wp, 187.11_wp, 546.56_wp, &
      0.23089_wp, 11.561_wp, 352.822_wp, 2568.96_wp, 5048.96_wp, 335.92_wp, 3147.76_wp, 160.84_wp, 468.71_wp, &
      0.24715_wp, 11.072_wp, 349.477_wp, 2388.65_wp, 4948.49_wp, 311.35_wp, 3011.58_wp, 148.56_wp, 453.76_wp, &
      0.26341_wp, 10.792_wp, 346.538_wp, 2271.99_wp, 4808.02_wp, 291.94_wp, 2882.62_wp, 140.3_wp, 436.22_wp, &
      0.29595_wp, 10.232_wp, 339.333_wp, 2050.05_wp, 4501.4_wp, 261.0_wp, 2613.97_wp, 124.61_wp, 398.18_wp, &
      0.32846_wp, 9.672_wp, 330.004_wp, 1828.25_wp, 4244.07_wp, 228.82_wp, 2357.48_wp, 109.42_wp, 362.08_wp, &
      0.36098_wp, 9.11_wp, 321.99_wp, 1588.71_wp, 3995.28_wp, 200.75_wp, 2146.86_wp, 94.36_wp, 335.01_wp, &
      0.3935_wp, 8.534_wp, 313.82_wp, 1361.93_wp, 3750.76_wp, 174.38_wp, 1944.09_wp, 80.24_wp, 308.57_wp, &
      0.42602_wp, 7.932_wp, 294.734_wp, 1102.38_wp, 3447.14_wp, 144.47_wp, 1632.7_wp, 62.67_wp, 263.87_wp, &
      0.45855_wp, 7.321_wp, 287.12_wp, 875.8_wp, 3139.07_wp, 119.98_wp, 1432.4_wp, 49.42_wp, 237.06_wp, &
      0.49106_wp, 6.711_wp, 263.343_wp, 681.3_wp, 2734.24_wp, 81.19_wp, 1168.76_wp, 37.34_wp, 196.41_wp, &
      0.52358_wp, 6.122_wp, 253.207_wp, 534.72_wp, 2554.87_wp, 69.09_wp, 1047.43_wp, 29.14_wp, 180.34_wp, &
      0.5561_wp, 5.546_wp, 241.666_wp, 408.9_wp, 2334.03_wp, 57.45_wp, 922.95_wp, 22.16_wp, 162.43_wp, &
      0.58862_wp, 4.971_wp, 220.638_wp, 314.54_wp, 1828.73_wp, 45.92_wp, 760.82_wp, 17.33_wp, 134.83_wp, &
      0.62115_wp, 4.401_wp, 200.293_wp, 238.63_wp, 1584.1_wp, 35.98_wp, 648.03_wp, 13.3_wp, 116.3_wp, &
      0.65366_wp, 3.834_wp, 179.404_wp, 175.88_wp, 1323.36_wp, 27.44_wp, 539.7_wp, 9.96_wp, 97.98_wp, &
      0.68618_wp, 3.332_wp, 165.094_wp, 126.01_wp, 1183.68_wp, 20.9_wp, 531.15_wp, 7.3_wp, 98.93_wp, &
      0.7187_wp, 2.89_wp, 154.411_wp, 107.26_wp, 1020.16_wp, 18.54_wp, 460.01_wp, 6.22_wp, 85.78_wp, &
      0.75122_wp, 2.503_wp, 138.935_wp, 90.88_wp, 797.81_wp, 16.28_wp, 375.75_wp, 5.19_wp, 69.96_wp, &
      0.78376_wp, 2.116_wp, 129.555_wp, 76.31_wp, 709.61_wp, 14.53_wp, 328.89_wp, 4.36_wp, 61.41_wp, &
      0.81626_wp, 1.73_wp, 107.264_wp, 61.05_wp, 518.19_wp, 9.07_wp, 244.04_wp, 3.36_wp, 45.44_wp, &
      0.84878_wp, 1.342_wp, 98.776_wp, 49.48_wp, 454.87_wp, 8.06_wp, 211.6_wp, 2.75_wp, 39.57_wp, &
      0.8813_wp, 0.954_wp, 90.248_wp, 39.36_wp, 395.12_wp, 7.08_wp, 181.52_wp, 2.21_wp, 34.09_wp, &
      0.89756_wp, 0.76_wp, 83.001_wp, 34.67_wp, 353.72_wp, 6.09_wp, 160.25_wp, 1.93_wp, 30.12_wp, &
      0.91382_wp, 0.574_wp, 72.906_wp, 30.41_wp, 304.73_wp, 5.75_wp, 109.23_wp, 1.69_wp, 20.15_wp, &
      0.93008_wp, 0.404_wp, 68.772_wp, 26.52_wp, 281.42_wp, 5.33_wp, 100.08_wp, 1.49_wp, 18.53_wp, &
      0.93821_wp, 0.319_wp, 66.264_wp, 23.84_wp, 261.71_wp, 4.94_wp, 92.24_wp, 1.34_wp, 17.11_wp, &
      0.94636_wp, 0.253_wp, 59.34_wp, 19.63_wp, 158.81_wp, 4.24_wp, 63.23_wp, 1.1_wp, 11.55_wp, &
      0.95447_wp, 0.216_wp, 55.914_wp, 16.0_wp, 137.88_wp, 3.66_wp, 53.32_wp, 0.89_wp, 9.77_wp, &
      0.9626_wp, 0.178_wp, 52.484_wp, 12.83_wp, 118.79_wp, 3.13_wp, 44.53_wp, 0.71_wp, 8.19_wp, &
      0.97073_wp, 0.14_wp, 49.114_wp, 10.08_wp, 101.63_wp, 2.64_wp, 36.9_wp, 0.56_wp, 6.82_wp, &
      0.97886_wp, 0.101_wp, 45.818_wp, 7.55_wp, 85.07_wp, 2.17_wp, 29.92_wp, 0.42_wp, 5.57_wp, &
      0.98699_wp, 0.062_wp, 41.669_wp, 4.6_wp, 64.26_wp, 1.58_wp, 21.31_wp, 0.25_wp, 4.01_wp, &
      0.99512_wp, 0.023_wp, 11.453_wp, 0.25_wp, 6.61_wp, 0.25_wp, 4.85_wp, 0.04_wp, 0.94_wp, &
      1.0_wp, 0.0_wp, 10.319_wp, 0.17_wp, 5.01_wp, 0.19_wp, 3.53_wp, 0.02_wp, 0.68_wp &
      ], [9, stations])

   ! Distance from the root (m) and chord (m) of the aerodynamic sections.
   real(wp), parameter :: chords(2, 17) = reshape([ &
      1.3667_wp, 3.542_wp, 4.1_wp, 3.854_wp, 6.8333_wp, 4.167_wp, 10.25_wp, 4.557_wp, 14.35_wp, 4.652_wp, 18.45_wp, 4.458_wp, &
      22.55_wp, 4.249_wp, 26.65_wp, 4.007_wp, 30.75_wp, 3.748_wp, 34.85_wp, 3.502_wp, 38.95_wp, 3.256_wp, 43.05_wp, 3.01_wp, &
      47.15_wp, 2.764_wp, 51.25_wp, 2.518_wp, 54.6667_wp, 2.313_wp, 57.4_wp, 2.086_wp, 60.1333_wp, 1.419_wp &
      ], [2, 17])
contains

   !> The properties at a station (1, 2, ...) or between two (1.5, ...), linear in between.
   pure function section(station) result(properties)
      real(wp), intent(in) :: station
      real(wp) :: properties(size(blade, 1))
      integer :: k

      k = min(int(station), stations - 1)
      properties = blade(:, k) + (station - k)*(blade(:, k + 1) - blade(:, k))
      properties([mass, flap_inertia, edge_inertia]) = mass_factor*properties([mass, flap_inertia, edge_inertia])
   end function section

   !> What a property per length (`mass`, ...) comes to at a station: the integral over its neighbourhood, so that the
   !> sums over the stations are the integrals and first moments over the blade.
   pure real(wp) function lumped(property, station)
      integer, intent(in) :: property, station
      real(wp) :: here(size(blade, 1)), other(size(blade, 1))
      integer :: k

      here = section(real(station, wp))
      lumped = 0
      do k = max(1, station - 1), min(stations, station + 1)
         other = section(real(k, wp))
         lumped = lumped + blade_length*abs(other(place) - here(place))*(2*here(property) + other(property))/6
      end do
   end function lumped

   !> The length of blade that belongs to a station, m.
   pure real(wp) function tributary(station)
      integer, intent(in) :: station

      tributary = blade_length*(blade(place, min(station + 1, stations)) - blade(place, max(station - 1, 1)))/2
   end function tributary

   !> The chord (m) at a distance from the root (m), linear between sections.
   pure real(wp) function chord(distance)
      real(wp), intent(in) :: distance
      real(wp) :: part
      integer :: k

      k = min(max(count(chords(1, :) <= distance), 1), size(chords, 2) - 1)
      part = min(max((distance - chords(1, k))/(chords(1, k + 1) - chords(1, k)), 0.0_wp), 1.0_wp)
      chord = chords(2, k) + part*(chords(2, k + 1) - chords(2, k))
   end function chord
end module scene_turbine_blade
