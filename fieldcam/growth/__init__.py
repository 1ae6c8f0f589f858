"""From sizes to a decision: fruitlets followed over days, growth rates, predicted set. Pure."""
